// SPDX-License-Identifier: Apache-2.0
// Two collisions are drawn, one in the share 1 - t of the finer volume and one in the share t of the coarser, and the
// nearer one counts: that is free flight in the sum of both media, exactly, without a majorant of the two.
//
// Faces fade by a number that a path has in cubes of two coarse resolutions: what fades out where something else fades
// in (a face that was split, pieces that were wrapped by a wall) is replaced there and leaves no gap, and leaves in
// other cubes fade independently, as the volume that takes their place does.
#include "bvh/traced_morph.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bvh/see_through.h"
#include "cache/level_file.h"

namespace farfield {

namespace {

constexpr float kFadingCell = 2;  // coarse resolutions
constexpr uint64_t kFadingSalt = 0x66616465;

uvec3 corners_of(const LevelView& level, uint32_t element) { return level.quads[element / 2].face(element % 2); }
uint32_t sides(const LevelView& level, uint32_t quad) { return level.quads[quad].is_pair() ? 2 : 1; }

/// Set in an element: a quad of two faces was hit, and which of them is known from where.
constexpr uint32_t kEitherFace = 1u << 31;

/// Faces of one geometry, with the vertices that they use: quads where they stay, triangles where they move (Embree
/// has no fast quads that move).
struct MorphFaces {
  std::vector<uint32_t> elements;
  std::vector<Quad> quads;
  std::vector<uvec3> triangles;
  std::vector<vec3> start, end;  ///< positions at t = 0 and 1; `end` only of what moves

  uint64_t bytes() const {
    return elements.size() * (sizeof(uint32_t) + sizeof(Quad)) + (start.size() + end.size()) * sizeof(vec3);
  }
};

/// Adds faces of a level to a geometry.
class FaceAdder {
 public:
  FaceAdder(const LevelView& level, MorphFaces& faces)
      : level_(level), faces_(faces), number_(level.positions.size(), kNotYet) {}

  void add_quad(uint32_t quad) {
    const Quad& corners = level_.quads[quad];
    faces_.elements.push_back(2 * quad | (corners.is_pair() ? kEitherFace : 0));
    faces_.quads.push_back({vertex(corners.v0), vertex(corners.v1), vertex(corners.v2), vertex(corners.v3)});
  }
  /// One of a quad's faces.
  void add_face(uint32_t element) {
    const uvec3 corners = corners_of(level_, element);
    faces_.elements.push_back(element);
    faces_.quads.push_back({vertex(corners.x), vertex(corners.y), vertex(corners.z), vertex(corners.z)});
  }
  /// One that moves; `ends`: where the level's vertices move to.
  void add_moving_face(uint32_t element, std::span<const vec3> ends) {
    const uvec3 corners = corners_of(level_, element);
    faces_.elements.push_back(element);
    faces_.triangles.emplace_back(vertex(corners.x, ends), vertex(corners.y, ends), vertex(corners.z, ends));
  }

 private:
  uint32_t vertex(uint32_t of_level, std::span<const vec3> ends = {}) {
    uint32_t& number = number_[of_level];
    if (number != kNotYet) return number;
    number = static_cast<uint32_t>(faces_.start.size());
    faces_.start.push_back(level_.positions[of_level]);
    if (!ends.empty()) faces_.end.push_back(ends[of_level]);
    return number;
  }

  static constexpr uint32_t kNotYet = 0xffffffffu;
  const LevelView& level_;
  MorphFaces& faces_;
  std::vector<uint32_t> number_;  ///< of the level's vertices among the geometry's
};

/// Where the finer level's vertices are in the coarser; those that leave the surface stay.
std::vector<vec3> ends_of(const LevelView& fine, const LevelView& coarse) {
  std::vector<vec3> ends(fine.positions.begin(), fine.positions.end());
  for (size_t v = 0; v < std::min(ends.size(), coarse.morph_vertex.size()); ++v) {
    if (coarse.morph_vertex[v] < coarse.positions.size()) ends[v] = coarse.positions[coarse.morph_vertex[v]];
  }
  return ends;
}

EmbreeGeometry make_geometry(EmbreeDeviceRef device, const MorphFaces& faces) {
  if (faces.elements.empty()) return {};
  const bool moves = !faces.end.empty();
  EmbreeGeometry geometry = moves ? new_triangles(device) : new_quads(device);
  if (moves) {
    set_time_steps(geometry.get(), 2);
    copy_array(geometry.get(), std::span(faces.triangles));
    copy_array(geometry.get(), std::span(faces.end), 1);
  } else {
    copy_array(geometry.get(), std::span(faces.quads));
  }
  copy_array(geometry.get(), std::span(faces.start));
  return geometry;
}

/// Shows a ray the geometry at t instead of the host's time.
class AtTime {
 public:
  AtTime(EmbreeRay& ray, float t) : ray_(ray), time_(ray.time) { ray.time = t; }
  ~AtTime() { ray_.time = time_; }
  AtTime(const AtTime&) = delete;
  AtTime& operator=(const AtTime&) = delete;

 private:
  EmbreeRay& ray_;
  float time_;
};

LocalRay local_ray(const EmbreeRay& ray) {
  return {{ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}, ray.tnear, ray.tfar};
}

float mix(float a, float b, float t) { return (1 - t) * a + t * b; }

}  // namespace

// --- Making ----------------------------------------------------------------------------------------------------------

/// The faces of both levels by what becomes of them.
struct TracedMorph::SortedFaces {
  std::array<MorphFaces, kGeometryCount> of;
  uint64_t table_bytes = 0;  ///< that sorting took beside the faces

  /// targets: per face of the finer level, as coarse_face().
  SortedFaces(const LevelView& fine, const LevelView& coarse, std::span<const uint32_t> targets) {
    const std::vector<vec3> ends = ends_of(fine, coarse);
    std::vector<uint8_t> is_reached(face_count(coarse), 0);
    FaceAdder staying(fine, of[kStaying]), moving(fine, of[kMoving]), fading_out(fine, of[kFadingOut]),
        fading_in(coarse, of[kFadingIn]);
    const auto face_moves = [&](uint32_t element, uint32_t target) {
      const uvec3 corners = corners_of(fine, element);
      const auto moves = [&](uint32_t vertex) { return ends[vertex] != fine.positions[vertex]; };
      return target != kMorphVoxelized && (moves(corners.x) || moves(corners.y) || moves(corners.z));
    };
    for (uint32_t quad = 0; quad < fine.quads.size(); ++quad) {
      const std::span<const uint32_t> quad_targets = targets.subspan(fine.quad_first_face[quad], sides(fine, quad));
      if (std::ranges::count(quad_targets, kMorphVoxelized) == std::ssize(quad_targets)) {
        fading_out.add_quad(quad);
        continue;
      }
      uint32_t moving_sides = 0, fading_sides = 0;
      for (uint32_t side = 0; side < quad_targets.size(); ++side) {
        const uint32_t target = quad_targets[side];
        if (target < is_reached.size()) is_reached[target] = 1;
        moving_sides |= uint32_t{face_moves(2 * quad + side, target)} << side;
        fading_sides |= uint32_t{target == kMorphVoxelized} << side;
      }
      if (moving_sides == 0 && fading_sides == 0) {
        staying.add_quad(quad);
        continue;
      }
      for (uint32_t side = 0; side < quad_targets.size(); ++side) {
        if (moving_sides >> side & 1) {
          moving.add_moving_face(2 * quad + side, ends);
        } else {
          (fading_sides >> side & 1 ? fading_out : staying).add_face(2 * quad + side);
        }
      }
    }
    for (uint32_t quad = 0; quad < coarse.quads.size(); ++quad) {
      const uint8_t* reached = &is_reached[coarse.quad_first_face[quad]];
      if (!reached[0] && (sides(coarse, quad) == 1 || !reached[1])) {
        fading_in.add_quad(quad);
        continue;
      }
      for (uint32_t side = 0; side < sides(coarse, quad); ++side) {
        if (!reached[side]) fading_in.add_face(2 * quad + side);
      }
    }
    table_bytes = ends.size() * (sizeof(vec3) + 3 * sizeof(uint32_t)) + coarse.positions.size() * sizeof(uint32_t) +
                  is_reached.size();
  }
  size_t count() const {
    size_t count = 0;
    for (const MorphFaces& faces : of) count += faces.elements.size();
    return count;
  }
  uint64_t bytes() const {
    uint64_t bytes = table_bytes;
    for (const MorphFaces& faces : of) bytes += 2 * faces.bytes();  // vectors have room to grow
    return bytes;
  }
};

Result<std::unique_ptr<TracedMorph>> TracedMorph::make(BvhDevice& device, const LevelView& fine,
                                                       const LevelView& coarse, uint64_t most_bytes) {
  if (fine.has_parts() || coarse.has_parts()) {
    return make_error(ErrorCode::BadFile, "a level whose parts stand in several places does not morph");
  }
  std::unique_ptr<TracedMorph> morph(new TracedMorph);
  std::vector<uint32_t>& targets = morph->coarse_face_;
  targets.assign(coarse.morph_face.begin(), coarse.morph_face.end());
  targets.resize(face_count(fine), kMorphVoxelized);

  const SortedFaces faces(fine, coarse, targets);
  morph->making_bytes_ = faces.bytes();
  for (size_t i = 0; i < kGeometryCount; ++i) morph->elements_[i] = faces.of[i].elements;
  if (faces.count() == 0) return morph;  // volumes alone

  morph->are_opaque_ = is_opaque(fine) && is_opaque(coarse);
  const auto make_geometries = [&] {
    std::vector<EmbreeGeometry> geometries;
    for (unsigned i = 0; i < kGeometryCount; ++i) {
      geometries.push_back(make_geometry(device.handle(), faces.of[i]));
      const bool fades = i == kFadingIn || i == kFadingOut;
      if (geometries.back() && (fades || !morph->are_opaque_)) set_filter(geometries.back().get(), filter, morph.get());
    }
    return geometries;
  };
  const uint64_t left = most_bytes - std::min(most_bytes, morph->making_bytes_);
  FARFIELD_TRY_LET(morph->built_, build_measured_scene(device, make_geometries, {left},
                                                       fmt::format("the morph of {} faces", faces.count())));
  return morph;
}

Result<std::unique_ptr<TracedMorph>> TracedMorph::build(BvhDevice& device, const LevelView& fine_level,
                                                        const LevelView& coarse_level, const TracedLevel& fine,
                                                        const TracedLevel& coarse, uint64_t most_bytes) {
  FARFIELD_TRY_LET(auto morph, make(device, fine_level, coarse_level, most_bytes));
  morph->fine_ = &fine;
  morph->coarse_ = &coarse;
  return morph;
}

LevelCost TracedMorph::cost(const LevelView& fine_level, const LevelView& coarse_level) const {
  const uint64_t files = level_file_sizes(fine_level).memory_bytes + level_file_sizes(coarse_level).memory_bytes;
  uint64_t tables = coarse_face_.size() * sizeof(uint32_t) + sizeof(TracedMorph);
  for (const std::vector<uint32_t>& elements : elements_) tables += elements.size() * sizeof(uint32_t);
  return {built_.bytes + tables, built_.build_peak_bytes + making_bytes_ + files};
}

Result<LevelCost> measure_morph(const LevelView& fine, const LevelView& coarse) {
  FARFIELD_TRY_LET(const auto device, BvhDevice::create());
  FARFIELD_TRY_LET(const auto morph, TracedMorph::make(*device, fine, coarse, kAnyBytes));
  return morph->cost(fine, coarse);
}

// --- Rays ------------------------------------------------------------------------------------------------------------

/// Which face was hit, and where on it.
TracedMorph::FaceHit TracedMorph::face_of(const EmbreeHit& hit) const {
  const uint32_t element = elements_[hit.geomID][hit.primID];
  if (!(element & kEitherFace)) return {element, vec2(hit.u, hit.v)};
  return {(element ^ kEitherFace) + quad_side(hit.u, hit.v), face_barycentric(hit.u, hit.v)};
}

/// Whether a hit counts: it may be half there, in a gap, or clear. Of a tree, nearly all hits are on leaves that fade:
/// whether one is there depends on the place alone, so tables are read only for those that are.
bool TracedMorph::stops(const EmbreeFilterArguments& args) const {
  const auto& context = *reinterpret_cast<const RayContext*>(args.context);
  const auto& ray = *reinterpret_cast<const EmbreeRay*>(args.ray);
  const auto& hit = *reinterpret_cast<const EmbreeHit*>(args.hit);
  const bool is_new = hit.geomID == kFadingIn, fades = is_new || hit.geomID == kFadingOut;
  const float t = ray.time;
  if (fades) {
    const float cell = kFadingCell * coarse_->view.header.resolution;
    const bool is_replaced = path_number(context, ray, cell, kFadingSalt) < t;
    if (is_replaced != is_new) return false;
    if (are_opaque_) return true;
  }
  const TracedLevel& level = is_new ? *coarse_ : *fine_;
  const auto [element, barycentric] = face_of(hit);
  const uint32_t face = level.face_of(element / 2, element % 2);
  const uint32_t target = fades ? kMorphVoxelized : coarse_face_[face];
  const bool becomes_face = target < coarse_->face_count;
  float gap = gap_along(level.view, face, ray, hit);
  if (becomes_face) gap = mix(gap, gap_along(coarse_->view, target, ray, hit), t);
  if (gap > 0 && path_number(context, ray, kGapCell * level.view.header.resolution, 0) < gap) return false;

  float opacity = opacity_at(level, context, ray, element / 2, face, barycentric);
  if (becomes_face && !coarse_->view.face_opacity.empty()) {
    opacity = mix(opacity, unpack_unorm8(coarse_->view.face_opacity[target]), t);
  }
  return opacity >= 1 || ray_number(context, ray, face) < opacity;
}

void TracedMorph::filter(const EmbreeFilterArguments* args) {
  if (args->valid[0] != -1) return;
  if (!static_cast<const TracedMorph*>(args->geometryUserPtr)->stops(*args)) args->valid[0] = 0;
}

/// In the sum of both volumes.
std::optional<VolumeHit> TracedMorph::first_collision(const LocalRay& ray, float t, uint64_t ray_bits,
                                                      bool& is_coarser) const {
  std::optional<VolumeHit> hit = fine_->volume.first_collision(ray, flight_seed(ray_bits, fine_->slot), 1 - t);
  LocalRay up_to_hit = ray;
  if (hit) up_to_hit.t_far = hit->t;
  const auto of_coarser = coarse_->volume.first_collision(up_to_hit, flight_seed(ray_bits, coarse_->slot), t);
  is_coarser = of_coarser.has_value();
  return of_coarser ? of_coarser : hit;
}

std::optional<MorphHit> TracedMorph::intersect(EmbreeRayHit& ray_hit, EmbreeContext& context, float t,
                                               uint64_t ray_bits) const {
  std::optional<MorphHit> result;
  if (built_.scene) {
    const AtTime scope(ray_hit.ray, t);
    if (trace_nearest(built_.scene.get(), context, ray_hit)) {
      const auto [element, barycentric] = face_of(ray_hit.hit);
      result = MorphHit{false, ray_hit.hit.geomID == kFadingIn, element, barycentric};
    }
  }
  bool is_coarser = false;
  if (const auto collision = first_collision(local_ray(ray_hit.ray), t, ray_bits, is_coarser)) {
    ray_hit.ray.tfar = collision->t;
    result = MorphHit{true, is_coarser, collision->payload, {}, collision->attenuation};
  }
  return result;
}

bool TracedMorph::occluded(EmbreeRay& ray, EmbreeContext& context, float t, uint64_t ray_bits,
                           float* transmittance) const {
  if (built_.scene) {
    const AtTime scope(ray, t);
    if (trace_occlusion(built_.scene.get(), context, ray)) return true;
  }
  if (transmittance) {
    const LocalRay local = local_ray(ray);
    *transmittance *=
        std::exp(-(1 - t) * fine_->volume.optical_depth(local) - t * coarse_->volume.optical_depth(local));
    return false;
  }
  bool is_coarser = false;
  if (!first_collision(local_ray(ray), t, ray_bits, is_coarser)) return false;
  ray.tfar = -std::numeric_limits<float>::infinity();
  return true;
}

}  // namespace farfield
