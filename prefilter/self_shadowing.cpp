// SPDX-License-Identifier: Apache-2.0
#include "prefilter/self_shadowing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "base/nonfinite.h"
#include "prefilter/sent_light.h"
#include "prefilter/voxel_ratios.h"
#include "scattering/albedo.h"
#include "scattering/highlight.h"
#include "scattering/highlight_lean.h"
#include "scattering/hot_spot.h"
#include "scattering/open_side.h"

namespace farfield {
namespace {

/// What the measurement of a brick counts in each of its voxels, in hits or in light of weight 1 that is sent on.
constexpr double kPriorLight = 64;
/// Sides of which light shows no spread along an axis say nothing about it: a share of their spread in all.
constexpr double kLeastSpread = 1e-2;

/// How much light gets away from what is seen of something.
struct Escape {
  FixedSum hits, away;
  FixedSum sent_back, away_back;         ///< of it, what the base reflects
  FixedSum sent_through, away_through;   ///< and what it lets through
  FixedSum away_highlight;               ///< of it, what the highlight reflects
  FixedSum away_spot;                    ///< what the hot spot's strength multiplies
  FixedSum away_lean;                    ///< what the highlight's lean multiplies
  std::array<FixedSum, 3> away_color;    ///< of the base, by channel
  std::array<FixedSum, 3> away_opening;  ///< what the open side multiplies
};

/// How much light that gets away is on the viewer's side.
struct Contrast {
  FixedSum away, contrast, slope, product;

  void add(double share_away, const SentOn& sent) {
    away.add(share_away);
    contrast.add(share_away * sent.contrast);
    slope.add(share_away * sent.slope);
    product.add(share_away * sent.contrast * sent.slope);
  }
};

/// What makes the mean contrast of the medium's light that gets away the geometry's; in [least, most].
float fitted_contrast(const Contrast& source, const Contrast& medium, float least, float most) {
  const double away = medium.away.value();
  if (!(source.away.value() > 0 && away > 0)) return 0;
  const double wanted = source.contrast.value() / source.away.value();
  // (contrast + x product) / (away + x slope) = wanted
  const double rate = medium.product.value() - wanted * medium.slope.value();
  if (!(rate > 0)) return 0;
  return static_cast<float>(std::clamp((wanted * away - medium.contrast.value()) / rate, double{least}, double{most}));
}

/// What sides light gets away from.
struct Sides {
  std::array<FixedSum, 3> side, opening;
  std::array<FixedSum, 9> moments;  ///< of side opening^T, by columns

  void add(double away, const SentOn& sent) {
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<size_t>(i);
      side[at].add(away * sent.side[i]);
      opening[at].add(away * sent.opening[i]);
      for (int j = 0; j < 3; ++j) moments[3 * at + static_cast<size_t>(j)].add(away * sent.opening[i] * sent.side[j]);
    }
  }
};

std::vector<double> divided(std::vector<double> a, const std::vector<double>& b) {
  for (size_t i = 0; i < a.size(); ++i) a[i] /= std::max(b[i], 1e-6);
  return a;
}

dvec3 vector_of(const std::array<FixedSum, 3>& sums) { return {sums[0].value(), sums[1].value(), sums[2].value()}; }

/// Light of one of two kinds: of the geometry, of the medium. Any thread may add.
struct Light {
  explicit Light(size_t voxels) : of_voxel(voxels) {}

  void add(uint32_t voxel, const SentOn& sent, double share_away) {
    const double away = share_away * sent.weight;
    Escape& escape = of_voxel[voxel];
    escape.away.add(away);
    for (int c = 0; c < 3; ++c) escape.away_color[static_cast<size_t>(c)].add(share_away * sent.color[c]);
    for (int i = 0; i < 3; ++i) escape.away_opening[static_cast<size_t>(i)].add(away * sent.opening[i]);
    all_away.add(away);
    sides.add(away, sent);
    if (sent.kind == SentOn::Kind::Highlight) {
      highlight.add(away, sent);
      escape.away_highlight.add(away);
      escape.away_lean.add(away * sent.slope);
      return;
    }
    if (sent.kind == SentOn::Kind::Through) {
      escape.sent_through.add(sent.weight);
      escape.away_through.add(away);
    } else {
      escape.sent_back.add(sent.weight);
      escape.away_back.add(away);
      back.add(away, sent);
      escape.away_spot.add(away * sent.slope);
    }
  }

  std::vector<Escape> of_voxel;
  FixedSum all_away;
  Contrast back, highlight;
  Sides sides;
};

class EscapeMeasurement {
 public:
  EscapeMeasurement(const LineScene& scene, const SparseVolume& volume)
      : scene_(scene), volume_(volume), source_(volume.voxels.size()), medium_(volume.voxels.size()) {}

  void add(const SeenLine& line, SplitMix& random) {
    if (line.hit) add_source(line, random);
    add_medium(line, random);
  }

  float hot_spot() const { return fitted_contrast(source_.back, medium_.back, 0, kStrongestHotSpot); }
  float highlight_lean() const {
    return fitted_contrast(source_.highlight, medium_.highlight, -kMostHighlightLean, kMostHighlightLean);
  }
  vec3 open_side() const;
  double highlight_ratio() const;
  std::vector<double> ratios(double highlight_ratio) const;
  vec3 color_ratio(const std::vector<double>& ratios) const;
  std::vector<double> ratios_through() const;

 private:
  void add_source(const SeenLine& line, SplitMix& random);
  void add_medium(const SeenLine& line, SplitMix& random);
  /// What the macrosurface stops it stops for both: it says nothing.
  bool meets_macrosurface(const vec3& from, const SentOn& sent, SplitMix& random) const {
    return scene_.is_stopped_by_macrosurface(from, sent.direction, near(), kInfinity, random);
  }
  /// Of each voxel's light, away / all, both of an Escape.
  template <typename Away, typename All>
  std::vector<double> shares(const Light& light, const Away& away, const All& all) const {
    std::vector<SourceAndMedium> sums(light.of_voxel.size());
    for (size_t v = 0; v < sums.size(); ++v) {
      sums[v].source.add(away(light.of_voxel[v]));
      sums[v].medium.add(all(light.of_voxel[v]));
    }
    return shrunk_ratios(volume_, sums, kPriorLight);
  }
  float near() const { return sent_clearance(scene_); }

  const LineScene& scene_;
  const SparseVolume& volume_;
  Light source_, medium_;
};

void EscapeMeasurement::add_source(const SeenLine& line, SplitMix& random) {
  const auto voxel = scene_.voxel_of_hit(line);
  const auto sent = scattered_by_source(scene_, line, random);
  if (!voxel || (sent && meets_macrosurface(line.point(), *sent, random))) return;
  source_.of_voxel[*voxel].hits.add(1);
  if (!sent) return;
  const bool is_stopped =
      sent->is_lost || scene_.is_stopped_by_geometry(line.point(), sent->direction, near(), kInfinity, random);
  source_.add(*voxel, *sent, is_stopped ? 0 : 1);
}

void EscapeMeasurement::add_medium(const SeenLine& line, SplitMix& random) {
  const auto collision = first_collision(volume_, scene_.grid(), line.ray, random);
  if (!collision) return;
  const auto sent = scattered_by_medium(volume_.voxels[collision->voxel], line, random);
  if (sent && meets_macrosurface(scene_.point_along(line.ray, collision->at), *sent, random)) return;
  medium_.of_voxel[collision->voxel].hits.add(1);
  if (!sent) return;
  const dvec3 at = line.ray.origin + collision->at * line.ray.direction;
  const VoxelRay away{at, dvec3(sent->direction), 0, kInfinity};
  medium_.add(collision->voxel, *sent, std::exp(-optical_depth(volume_, scene_.grid(), away)));
}

/// The mean side of the light that gets away must be the geometry's.
vec3 EscapeMeasurement::open_side() const {
  const double source = source_.all_away.value(), medium = medium_.all_away.value();
  if (!(source > 0 && medium > 0)) return vec3(0.0f);
  const dvec3 wanted = vector_of(source_.sides.side) / source, is = vector_of(medium_.sides.side) / medium;
  const dvec3 opening = vector_of(medium_.sides.opening) / medium;
  glm::dmat3 moments;
  for (int i = 0; i < 9; ++i) moments[i / 3][i % 3] = medium_.sides.moments[static_cast<size_t>(i)].value() / medium;
  // (is + moments x) / (1 + opening.x) = wanted; with a share of the trace more where the sides have no spread
  const glm::dmat3 slope = moments - glm::outerProduct(wanted, opening);
  const double trace = moments[0][0] + moments[1][1] + moments[2][2];
  const dvec3 x = glm::inverse(slope + glm::dmat3(kLeastSpread * trace)) * (wanted - is);
  const double length = glm::length(x);
  if (!std::isfinite(length)) return vec3(0.0f);
  return vec3(length > kMostOpenSide ? x * (kMostOpenSide / length) : x);
}

/// How much more of the highlight gets away than of the rest, in the geometry by what it does in the medium. Of the
/// level as a whole: single voxels have too few highlights.
double EscapeMeasurement::highlight_ratio() const {
  const auto odds = [&](const Light& light, float lean) {
    double highlight = 0, rest = 0;
    for (const Escape& escape : light.of_voxel) {
      highlight += escape.away_highlight.value() + double{lean} * escape.away_lean.value();
      rest += escape.away.value() - escape.away_highlight.value();
    }
    return highlight > 0 && rest > 0 ? highlight / rest : 0.0;
  };
  const double source = odds(source_, 0), medium = odds(medium_, volume_.highlight_lean);
  return source > 0 && medium > 0 ? source / medium : 1.0;
}

/// The light that gets away from a hit on the geometry by that from a hit on the medium, as the volume has it by now
/// but for the highlight's ratio, voxel by voxel.
std::vector<double> EscapeMeasurement::ratios(double highlight_ratio) const {
  const auto medium_away = [&](const Escape& escape) {
    const double highlight = escape.away_highlight.value() + double{volume_.highlight_lean} * escape.away_lean.value();
    return escape.away.value() - escape.away_highlight.value() + highlight_ratio * highlight +
           double{volume_.hot_spot} * escape.away_spot.value() +
           glm::dot(dvec3(volume_.open_side), vector_of(escape.away_opening));
  };
  const auto source_away = [](const Escape& escape) { return escape.away.value(); };
  const auto hits = [](const Escape& escape) { return escape.hits.value(); };
  return divided(shares(source_, source_away, hits), shares(medium_, medium_away, hits));
}

/// How much more of each channel gets away from the base than of all of it, in the geometry by what it does in the
/// medium with these ratios: what is seen and what is lit as well have not quite one colour. Of the level as a whole.
vec3 EscapeMeasurement::color_ratio(const std::vector<double>& ratios) const {
  dvec3 source(0.0), medium(0.0);
  for (size_t v = 0; v < ratios.size(); ++v) {
    source += vector_of(source_.of_voxel[v].away_color);
    medium += std::clamp(ratios[v], kLeastEscape, kMostEscape) * vector_of(medium_.of_voxel[v].away_color);
  }
  const double all_source = source.x + source.y + source.z, all_medium = medium.x + medium.y + medium.z;
  vec3 ratio(1.0f);
  for (int c = 0; c < 3; ++c) {
    if (!(source[c] > 0 && medium[c] > 0)) continue;
    ratio[c] = static_cast<float>(std::clamp(source[c] / medium[c] * (all_medium / all_source), 0.5, 2.0));
  }
  return ratio;
}

/// How much more of the light gets away that flakes let through than of what they reflect, in the geometry by what it
/// does in the medium.
std::vector<double> EscapeMeasurement::ratios_through() const {
  const auto odds = [&](const Light& light) {
    const auto value = [](FixedSum Escape::*field) { return [field](const Escape& e) { return (e.*field).value(); }; };
    return divided(shares(light, value(&Escape::away_through), value(&Escape::sent_through)),
                   shares(light, value(&Escape::away_back), value(&Escape::sent_back)));
  };
  return divided(odds(source_), odds(medium_));
}

/// What light of each channel is multiplied by that flakes of this albedo scatter, so that `share` in [1, 2] times as
/// much of it gets away. Where all of it gets away at once (a resolved surface, share 2), or what is kept goes through
/// half of the flakes that it meets and gets away behind them, the odds of the albedo are multiplied (odds_gain). What
/// else is kept does not come back to where it is seen: the albedo itself is, but for white (docs/decisions/0033).
vec3 escape_gain(const vec3& albedo, const vec3& through, float share) {
  const vec3 power = 1.0f + (2.0f - share) * glm::max(1.0f - 2.0f * through, vec3(0.0f));
  const vec3 kept = glm::pow(albedo, power);
  return share / (vec3(1.0f) - kept + share * kept);
}

}  // namespace

void let_through(double ratio, Voxel& voxel) {
  const auto odds = static_cast<float>(std::clamp(ratio, kLeastThrough, kMostThrough));
  const vec3 base = voxel.diffuse + voxel.transmission;
  voxel.transmission = base * cluster_albedo(voxel.transmission / glm::max(base, vec3(1e-6f)), odds);
  voxel.diffuse = glm::max(base - voxel.transmission, vec3(0.0f));
}

void recolor(const vec3& ratio, Voxel& voxel) {
  const vec3 base = voxel.diffuse + voxel.transmission;
  for (int c = 0; c < 3; ++c) {
    const float gain = odds_gain(vec3(std::min(base[c], 1.0f)), ratio[c]).x;
    voxel.diffuse[c] *= gain, voxel.transmission[c] *= gain;
  }
}

void let_glance(double ratio, Voxel& voxel) {
  const auto odds = static_cast<float>(std::clamp(ratio, kLeastGlance, kMostGlance));
  const vec3 own = voxel.specular;
  const auto mean = [&](const vec3& f0) { return Highlight(f0, voxel.roughness2).mean_albedo(); };
  const vec3 wanted = cluster_albedo(mean(own), odds);
  vec3 low(0.0f), high(1.0f);
  constexpr int kSteps = 12;  // far finer than the file's 8 bits
  for (int i = 0; i < kSteps; ++i) {
    const vec3 middle = 0.5f * (low + high), is = mean(middle);
    for (int c = 0; c < 3; ++c) (is[c] < wanted[c] ? low : high)[c] = middle[c];
  }
  for (int c = 0; c < 3; ++c) {
    if (own[c] > 0) voxel.specular[c] = 0.5f * (low[c] + high[c]);
  }
}

void let_escape(double ratio, Voxel& voxel) {
  const vec3 albedo = layered_albedo(voxel.specular, voxel.diffuse + voxel.transmission);
  if (!(max_component(albedo) > 0)) return;  // rays say nothing of what sends nothing
  const auto share = static_cast<float>(std::clamp(ratio, kLeastEscape, kMostEscape));
  voxel.self_shadowing = std::min(share, 1.0f);
  if (!(share > 1)) return;
  const vec3 through = voxel.transmission / glm::max(voxel.diffuse + voxel.transmission, vec3(1e-6f));
  const vec3 gain = escape_gain(glm::min(albedo, vec3(1.0f)), through, share);
  voxel.diffuse *= gain;
  voxel.specular *= gain;
  voxel.transmission *= gain;
}

Result<void> measure_self_shadowing(const LineScene& scene, SparseVolume& volume, const SelfShadowingOptions& options) {
  if (volume.voxels.empty()) return {};
  EscapeMeasurement measurement(scene, volume);
  FARFIELD_TRY(for_lines(scene, {options.lines, options.seed, options.job},
                         [&](const SeenLine& line, SplitMix& random) { measurement.add(line, random); }));
  volume.hot_spot = measurement.hot_spot();
  volume.highlight_lean = measurement.highlight_lean();
  volume.open_side = measurement.open_side();
  const double highlight = std::clamp(measurement.highlight_ratio(), kLeastGlance, kMostGlance);
  const std::vector<double> through = measurement.ratios_through(), ratios = measurement.ratios(highlight);
  const vec3 color = measurement.color_ratio(ratios);
  for (size_t v = 0; v < ratios.size(); ++v) {
    recolor(color, volume.voxels[v]);
    let_through(through[v], volume.voxels[v]);
    let_glance(highlight, volume.voxels[v]);
    let_escape(ratios[v], volume.voxels[v]);
  }
  return {};
}

}  // namespace farfield
