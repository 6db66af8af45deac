// SPDX-License-Identifier: Apache-2.0
#include "prefilter/sent_light.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prefilter/random_lobe.h"
#include "scattering/highlight.h"
#include "scattering/hot_spot.h"
#include "scattering/microfacet_brdf.h"
#include "scattering/sggx.h"
#include "scattering/visible_normal.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

/// On the side that a line comes from, unit. Of a flake both are one.
struct Normals {
  vec3 shading, geometric;

  bool is_below_horizon(const vec3& direction, bool is_through) const {
    return (glm::dot(geometric, direction) > 0) == is_through;
  }
};

/// A cosine lobe around the shading normal; what it has below the horizon is around the geometric one, as in
/// scattering/horizon_lobe.h.
vec3 base_lobe(const Normals& normals, bool is_through, SplitMix& random) {
  const float side = is_through ? -1.0f : 1.0f;
  const vec3 direction = random_lobe(side * normals.shading, random);
  return normals.is_below_horizon(direction, is_through) ? random_lobe(side * normals.geometric, random) : direction;
}

/// Of the base: on the side that the light came from or, as often as light goes through, on the other.
template <typename Material>
SentOn scattered_by_base(const Material& m, const Normals& normals, const vec3& direction, SplitMix& random) {
  const float through = component_sum(m.transmission), back = component_sum(m.diffuse);
  const bool is_through = static_cast<float>(random.next_unit()) * (through + back) < through;
  const vec3& seen = normals.shading;
  SentOn sent{.direction = base_lobe(normals, is_through, random), .side = seen};
  sent.kind = is_through ? SentOn::Kind::Through : SentOn::Kind::Reflected;
  if (!is_through) {
    sent.contrast =
        hot_spot_lobe(-glm::dot(direction, sent.direction)) - mean_hot_spot_lobe(-glm::dot(direction, seen));
    sent.slope = sent.contrast;
  }
  sent.opening = (1 - std::min((through + back) / 3, 1.0f)) * seen;
  sent.weight = 1;
  return sent;
}

/// What one facet of the highlight reflects; its weight is 1 in the mean. `once`: what facets do in all.
SentOn scattered_by_facet(const Highlight& highlight, float once, const Normals& normals, const vec3& wo,
                          SplitMix& random) {
  const vec3& seen = normals.shading;
  const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  const Microfacets facets(specular_sggx(SymMat3::outer(seen), highlight.alpha() * highlight.alpha()), seen);
  SentOn sent{.direction = reflect_about(wo, facets.sample_visible(wo, u1, u2))};
  const float cosine = glm::dot(seen, sent.direction), pdf = specular_facets_pdf(facets, wo, sent.direction, seen);
  if (!(cosine > 0) || !(pdf > 0)) return sent;
  const vec3 value = eval_specular_facets<Masking::HeightCorrelated>(
      facets, wo, glm::dot(seen, wo), sent.direction, cosine, [&](float cos) { return highlight.fresnel(cos); });
  sent.weight = component_sum(value) / (pdf * once);
  return sent;
}

/// Of the highlight: by one facet or, of rough ones, over several. `rest`: what the whole surface absorbs.
/// share: towards wo.
SentOn scattered_by_highlight(const Highlight& highlight, const HighlightShare& share, const Normals& normals,
                              const vec3& wo, float rest, SplitMix& random) {
  const vec3& seen = normals.shading;
  const float all = component_sum(highlight.albedo(share)), once = component_sum(highlight.once(share));
  const bool is_once = static_cast<float>(random.next_unit()) * all < once;
  SentOn sent;
  if (is_once) {
    sent = scattered_by_facet(highlight, once, normals, wo, random);
    sent.opening = rest * seen;
  } else {
    sent.direction = random_lobe(seen, random);
    sent.weight = 1;
  }
  sent.contrast = glm::dot(wo, sent.direction);
  sent.slope = is_once ? sent.contrast * rest : 0.0f;
  sent.side = seen;
  sent.is_lost = normals.is_below_horizon(sent.direction, false);
  return sent;
}

/// Where light goes on that arrived along `direction`. Material: FaceMaterial or Voxel. Nothing for black ones.
template <typename Material>
std::optional<SentOn> scattered(const Material& m, const Normals& normals, const vec3& direction, SplitMix& random) {
  const vec3 wo = -direction;
  const Highlight highlight(m.specular, m.roughness2);
  HighlightShare share{};
  vec3 mirror(0.0f);
  if (highlight.exists()) {
    share = highlight.share(glm::dot(normals.shading, wo));
    mirror = highlight.albedo(share);
  }
  const float of_mirror = component_sum(mirror);
  const float of_base = component_sum((vec3(1.0f) - mirror) * (m.diffuse + m.transmission)), all = of_mirror + of_base;
  if (!(all > 0)) return {};
  SentOn sent;
  if (static_cast<float>(random.next_unit()) * all < of_mirror) {
    sent = scattered_by_highlight(highlight, share, normals, wo, 1 - std::min(all / 3, 1.0f), random);
  } else {
    sent = scattered_by_base(m, normals, direction, random);
    sent.color = (vec3(1.0f) - mirror) * (m.diffuse + m.transmission) * (all / of_base);
  }
  sent.weight *= all;
  sent.light = sent.kind == SentOn::Kind::Highlight ? sent.weight / of_mirror * mirror : sent.color;
  return sent;
}

/// One of the normals that light sees on a face.
vec3 seen_normal(const FaceMaterial& material, const vec3& geometric, const vec3& wo, SplitMix& random) {
  if (!(material.shading_sggx.trace() > 0)) return geometric;
  const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  return visible_normal(Sggx(cholesky(material.shading_sggx)).sample_visible(wo, u1, u2), geometric, wo);
}

}  // namespace

std::optional<SentOn> scattered_by_source(const LineScene& scene, const SeenLine& line, SplitMix& random) {
  const float longest = max_component(glm::abs(line.hit->normal));
  if (!(longest >= std::numeric_limits<float>::min())) return {};
  // In two steps: the square of a tiny face's normal may be no float.
  const vec3 normal = glm::normalize(line.hit->normal / longest), wo = -line.direction;
  const vec3 geometric = glm::dot(normal, wo) < 0 ? -normal : normal;
  const FaceMaterial& material = scene.geometry().materials[line.hit->triangle];
  return scattered(material, {seen_normal(material, geometric, wo, random), geometric}, line.direction, random);
}

std::optional<SentOn> scattered_by_medium(const Voxel& voxel, const SeenLine& line, SplitMix& random) {
  const auto u1 = to_unit_float(random.next()), u2 = to_unit_float(random.next());
  const vec3 normal = Sggx(cholesky(voxel.sggx)).sample_visible(-line.direction, u1, u2);
  return scattered(voxel, {normal, normal}, line.direction, random);
}

}  // namespace farfield
