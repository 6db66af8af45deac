// SPDX-License-Identifier: Apache-2.0
// Rays along the normals of the sheet measure what it covers, the pieces' areas how wide and deep they are; rays in all
// directions then say how the two go together (fit_shape), for each connected sheet.
#include "prefilter/sheet_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/hash.h"
#include "base/parallel.h"
#include "prefilter/disjoint_sets.h"
#include "prefilter/grid_cells.h"
#include "prefilter/isotropic_lines.h"
#include "prefilter/material_filter.h"
#include "prefilter/sheet_mesh.h"
#include "prefilter/wall_pieces.h"
#include "scattering/warp.h"

namespace farfield {
namespace {

constexpr size_t kRays = 1 << 17;  ///< along normals, and as many in other directions
constexpr size_t kLeastRaysOfFace = 8, kMostRaysOfFace = 1024;
constexpr float kHalfDepth = 0.75f;    ///< in resolutions: how far from the sheet rays look for pieces
constexpr float kLeastCosine = 0.15f;  ///< flatter rays look as far along the sheet as these
constexpr size_t kMostFitRays = 8192;

/// How a ray of any direction fared.
struct SlantedRay {
  vec3 direction;
  bool is_stopped;
};

/// Light that fronts send on, or sides.
struct Sent {
  float all = 0, caught = 0;
  void add(const Sent& other, float factor = 1) { all += factor * other.all, caught += factor * other.caught; }
  float caught_share() const { return all > 0 ? caught / all : 0.0f; }
};

struct FaceSeen {
  float area = 0;
  vec3 normal{0.0f};
  float stopped = 0;  ///< share of the rays along the normal
  std::vector<SlantedRay> slanted;
  float hits = 0;  ///< of these
  FaceMaterial sum = no_material();
  Sent by_fronts, by_sides;
};

/// Looks at pieces from a sheet.
class SheetViewer {
 public:
  SheetViewer(const OpacityScene& pieces, double resolution)
      : viewer_(pieces, resolution), depth_(kHalfDepth * static_cast<float>(resolution)) {}

  FaceSeen look_from(const TrianglePiece& face, size_t rays, uint64_t seed) const {
    FaceSeen seen;
    SplitMix random(seed);
    seen.area = static_cast<float>(0.5 * glm::length(area_vector_of(face)));
    seen.normal = vec3(glm::normalize(area_vector_of(face)));
    for (size_t i = 0; i < rays; ++i) {
      const auto place = even_coordinates(i, seed), way = even_coordinates(i, ~seed);
      const vec3 side = i % 2 == 0 ? seen.normal : -seen.normal;
      if (look(point_on(face, place[0], place[1]), side, depth_, random))
        seen.stopped += 1.0f / static_cast<float>(rays);
      const vec3 away = cosine_lobe(side, static_cast<float>(way[0]), static_cast<float>(way[1]));
      const float start = depth_ / std::max(glm::dot(away, side), kLeastCosine);
      const auto piece = look(point_on(face, way[2], way[3]), away, start, random);
      seen.slanted.push_back({away, piece.has_value()});
      if (piece) add(*piece, seen);
    }
    return seen;
  }

 private:
  std::optional<PieceSeen> look(const dvec3& at, const vec3& away, float start, SplitMix& random) const {
    return viewer_.look(vec3(at) + start * away, -away, 2 * start, random);
  }

  static void add(const PieceSeen& piece, FaceSeen& seen) {
    const float caught = piece.escapes ? 0.0f : 1.0f, cosine = glm::dot(piece.normal, seen.normal);
    const float front = cosine * cosine;
    seen.hits += 1;
    seen.sum = mix(seen.sum, 1, *piece.material, 1);
    seen.by_fronts.add({front, front * caught});
    seen.by_sides.add({1 - front, (1 - front) * caught});
  }

  PieceViewer viewer_;
  float depth_;
};

/// What the pieces of a place are like.
struct Place {
  float gap = 1;  ///< along the normal
  SymMat3 areas;  ///< projected, squared; 1 along the normal
};

/// Places by cells of one resolution, each with what its neighbours know.
class Places {
 public:
  Places(const Surface& pieces, const Surface& sheet, std::span<const FaceSeen> seen, double resolution)
      : resolution_(resolution) {
    for (size_t f = 0; f < seen.size(); ++f) {
      Cell& cell = cells_[key_of(middle_of(corners_of(sheet, f)))];
      const auto area = static_cast<double>(seen[f].area);
      cell.area += area, cell.stopped += area * static_cast<double>(seen[f].stopped);
      const dvec3 normal(seen[f].normal);
      cell.normal += glm::dot(cell.normal, normal) < 0 ? -normal : normal;
    }
    for (size_t f = 0; f < pieces.triangles.size(); ++f) {
      const TrianglePiece piece = corners_of(pieces, f);
      cells_[key_of(middle_of(piece))].areas.push_back(area_vector_of(piece));
    }
    std::vector<std::pair<uint64_t, Place*>> wanted;
    for (const auto& [key, cell] : cells_) {
      if (cell.area > 0) wanted.emplace_back(key, &places_[key]);
    }
    parallel_for(wanted.size(), 16, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) *wanted[i].second = measure(wanted[i].first);
    });
  }

  const Place& of(const dvec3& point) const { return places_.at(key_of(point)); }

 private:
  struct Cell {
    double area = 0, stopped = 0;  ///< of the sheet, and of it what rays along the normal do not pass
    dvec3 normal{0.0};
    std::vector<dvec3> areas;
  };

  uint64_t key_of(const dvec3& point) const { return cell_key(ivec3(glm::floor(point / resolution_))); }

  Place measure(uint64_t key) const {
    double area = 0, stopped = 0;
    glm::dmat3 second(0.0);
    const dvec3 normal = glm::normalize(cells_.at(key).normal);
    for_each_around(key, [&](const Cell& cell) {
      area += cell.area, stopped += cell.stopped;
      for (const dvec3& a : cell.areas) {
        if (const double length = glm::length(a); length > 0) second += glm::outerProduct(a, a) / length;
      }
    });
    // Main directions of the pieces' normals within the sheet.
    const BasicFrame<double> frame(normal);
    const dvec3 x = frame.to_world({1, 0, 0}), y = frame.to_world({0, 1, 0});
    const double turn =
        0.5 * std::atan2(2 * glm::dot(x, second * y), glm::dot(x, second * x) - glm::dot(y, second * y));
    const dvec3 t = std::cos(turn) * x + std::sin(turn) * y, b = glm::cross(normal, t);
    dvec3 shown(0.0);
    for_each_around(key, [&](const Cell& cell) {
      for (const dvec3& a : cell.areas) shown += glm::abs(dvec3(glm::dot(a, normal), glm::dot(a, t), glm::dot(a, b)));
    });
    Place place;
    place.gap = static_cast<float>(1 - stopped / area);
    place.areas = SymMat3::outer(vec3(normal));
    if (shown.x > 0) {
      place.areas += SymMat3::outer(vec3(t * (shown.y / shown.x))) + SymMat3::outer(vec3(b * (shown.z / shown.x)));
    }
    return place;
  }

  template <typename Visit>
  void for_each_around(uint64_t key, const Visit& visit) const {
    for_each_cell_around(cell_of_key(key), 1, [&](const ivec3& neighbour) {
      if (const auto found = cells_.find(cell_key(neighbour)); found != cells_.end()) visit(found->second);
    });
  }

  double resolution_;
  std::unordered_map<uint64_t, Cell> cells_;
  std::unordered_map<uint64_t, Place> places_;
};

/// A slanted ray and what is known where it meets the sheet.
struct Trial {
  float gap;    ///< along the normal
  float sides;  ///< SheetAreas, as the pieces' areas say
  float stopped;
  float area;  ///< that it stands for
};

struct FittedShape {
  SheetShape shape;
  float depth = 1;  ///< times what the pieces' areas say of sides
};

float stopped_share(const FittedShape& fitted, const Trial& trial) {
  return 1 - sheet_gap(fitted.shape, trial.gap, {fitted.depth * trial.sides});
}

/// The mean square of what the shape says wrong, and a little for every departure from the areas, which edges and
/// depths could make up for one another.
double misfit(const FittedShape& fitted, std::span<const Trial> trials) {
  constexpr double kTrustInAreas = 0.003;
  double sum = 0, area = 0;
  for (const Trial& trial : trials) {
    const float error = stopped_share(fitted, trial) - trial.stopped;
    sum += static_cast<double>(trial.area * error * error), area += static_cast<double>(trial.area);
  }
  const auto departure = static_cast<double>(fitted.depth - 1);
  return sum / area + kTrustInAreas * departure * departure;
}

/// Neighbours of a shape at steps of this size.
template <typename Visit>
void for_each_shape_around(const FittedShape& middle, float step, int reach, const Visit& visit) {
  constexpr float kLeastOrder = 1.0f / 16, kMostDepth = 2;
  for_each_cell_around(ivec3(0), reach, [&](const ivec3& offset) {
    const vec3 by = step * vec3(offset);
    FittedShape shape = middle;
    shape.shape.edge = std::clamp(middle.shape.edge + by.x, 0.0f, 1.0f);
    shape.shape.order = std::clamp(middle.shape.order + by.y, kLeastOrder, 1.0f);
    shape.depth = std::clamp(middle.depth + 2 * by.z, 0.0f, kMostDepth);
    visit(shape);
  });
}

/// The depth, within a factor of two, at which as many rays are stopped as were.
float depth_that_stops_as_many(FittedShape fitted, std::span<const Trial> trials) {
  double wanted = 0;
  for (const Trial& trial : trials) wanted += static_cast<double>(trial.area * trial.stopped);
  float low = 0.5f * fitted.depth, high = 2 * fitted.depth;
  for (int i = 0; i < 16; ++i) {
    fitted.depth = 0.5f * (low + high);
    double stopped = 0;
    for (const Trial& trial : trials) stopped += static_cast<double>(trial.area * stopped_share(fitted, trial));
    (stopped < wanted ? low : high) = fitted.depth;
  }
  return 0.5f * (low + high);
}

/// Least squares over some of the rays, then the right mean over all.
FittedShape fit_shape(std::span<const Trial> trials) {
  std::vector<Trial> some;
  const size_t stride = trials.size() / kMostFitRays + 1;
  for (size_t i = 0; i < trials.size(); i += stride) some.push_back(trials[i]);
  FittedShape best{{0.5f, 0.5f, 1}, 1};
  double least = misfit(best, some);
  int reach = 2;
  for (const float step : {0.25f, 0.125f, 0.0625f}) {
    const FittedShape middle = best;
    for_each_shape_around(middle, step, reach, [&](const FittedShape& shape) {
      const double error = misfit(shape, some);
      if (error < least) least = error, best = shape;
    });
    reach = 1;
  }
  best.depth = depth_that_stops_as_many(best, trials);
  return best;
}

/// Faces by the connected sheet that they are of, in order of first faces.
std::vector<std::vector<uint32_t>> connected_faces(const Surface& sheet) {
  DisjointSets vertices(sheet.positions.size());
  for (const uvec3& t : sheet.triangles) vertices.join(t.x, t.y), vertices.join(t.x, t.z);
  std::vector<std::vector<uint32_t>> parts;
  std::unordered_map<uint32_t, size_t> part_of;
  for (uint32_t f = 0; f < sheet.triangles.size(); ++f) {
    const auto [place, is_new] = part_of.try_emplace(vertices.least_of(sheet.triangles[f].x), parts.size());
    if (is_new) parts.emplace_back();
    parts[place->second].push_back(f);
  }
  return parts;
}

/// Sides as deep as they were found to be.
SymMat3 deepened(const SymMat3& areas, const vec3& n, float depth) {
  const mat3 stretch = depth * mat3(1.0f) + (1 - depth) * glm::outerProduct(n, n);
  return congruence(stretch, areas);
}

/// Materials of one connected sheet.
void shade(std::span<const uint32_t> faces, std::span<const FaceSeen> seen, const Places& places, Surface& sheet) {
  std::vector<Trial> trials;
  FaceMaterial sum = no_material();
  float hits = 0;
  Sent by_fronts, by_sides;
  for (const uint32_t f : faces) {
    const FaceSeen& face = seen[f];
    const Place& place = places.of(middle_of(corners_of(sheet, f)));
    for (const SlantedRay& ray : face.slanted) {
      const float sides = sheet_areas(place.areas, face.normal, ray.direction).sides;
      trials.push_back({place.gap, sides, ray.is_stopped ? 1.0f : 0.0f, face.area});
    }
    hits += face.area * face.hits;
    sum = mix(sum, 1, face.sum, face.area);
    by_fronts.add(face.by_fronts, face.area), by_sides.add(face.by_sides, face.area);
  }
  if (!(hits > 0)) return;
  const FittedShape fitted = fit_shape(trials);
  Sent by_all = by_fronts;
  by_all.add(by_sides);
  const float usual_escape = 1 - by_all.caught_share();
  for (const uint32_t f : faces) {
    const Place& place = places.of(middle_of(corners_of(sheet, f)));
    const FaceMaterial& own = seen[f].hits > 0 ? seen[f].sum : sum;
    FaceMaterial m = mix(own, 1 / (seen[f].hits > 0 ? seen[f].hits : hits), own, 0);
    const vec3 of_fronts = kept_light(m, by_fronts.caught_share(), usual_escape);
    m.diffuse *= of_fronts, m.specular *= of_fronts, m.transmission *= of_fronts;
    m.sheet = fitted.shape;
    m.sheet.caught = by_sides.caught_share();
    m.opacity = 1;
    m.gap = place.gap;
    m.shading_sggx = {};
    m.sggx = deepened(place.areas, seen[f].normal, fitted.depth);
    sheet.materials[f] = m;
  }
}

}  // namespace

Result<Surface> lay_sheet(const Surface& pieces, double resolution) {
  Surface sheet = make_sheet_mesh(pieces, resolution);
  const Surface cut = in_pieces(pieces, 0.5 * resolution);
  FARFIELD_TRY_LET(const auto scene, OpacityScene::build(cut));
  const SheetViewer viewer(scene, resolution);
  std::vector<FaceSeen> seen(sheet.triangles.size());
  const size_t rays = std::clamp(kRays / std::max(seen.size(), size_t{1}), kLeastRaysOfFace, kMostRaysOfFace);
  parallel_for(seen.size(), 64, [&](size_t begin, size_t end) {
    for (size_t f = begin; f < end; ++f) seen[f] = viewer.look_from(corners_of(sheet, f), rays, mix64(f));
  });
  const Places places(cut, sheet, seen, resolution);
  sheet.materials.assign(sheet.triangles.size(), no_material());
  for (const std::vector<uint32_t>& part : connected_faces(sheet)) shade(part, seen, places, sheet);

  // Faces where nothing was hit are no sheet.
  Surface result{sheet.positions, {}, {}, sheet.origin, {}};
  for (size_t f = 0; f < sheet.triangles.size(); ++f) {
    if (!sheet.materials[f].sheet.is_sheet()) continue;
    result.triangles.push_back(sheet.triangles[f]);
    result.materials.push_back(sheet.materials[f]);
  }
  return result;
}

}  // namespace farfield
