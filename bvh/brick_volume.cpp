// SPDX-License-Identifier: Apache-2.0
// Two nested DDAs [Amanatides and Woo 1987], over bricks and over the voxels of a brick, and exact free flight in the
// piecewise constant medium that they enumerate. A ray that cannot collide in what is occupied looks at no brick, and a
// brick in which few collisions are likely is skimmed [Woodcock et al. 1965] instead of crossed: its densest voxel
// stands for all, so that no voxel is looked at but where a tentative collision is (docs/decisions/0018).
//
// In bricks that are crossed, densities (1 byte per voxel) are read for every voxel, the 6 bytes of a voxel's SGGX
// matrix and the 2 of its octants' shares only where they may matter: since lambda_max(S) = 1 and shares are at most 1,
// rho |d| bounds the attenuation share rho sqrt(d^T S d). So:
//
//   1. fly with rho |d| until a tentative collision, in some voxel V at s_c;
//   2. fetch S and shares of V; the collision is real with probability share sqrt(d^T S d) / |d|;
//   3. if not, V's true attenuation is known by now: the rest of V is crossed with it, octant by octant, and its end
//      with a fresh optical depth for the voxels behind it.
//
// Exponential flights have no memory, so steps 2 and 3 keep the distribution exact, and each voxel costs at most two
// draws: nothing loops where rho is huge and sigma zero (flat flakes seen edge-on).
//
// Parameters: t is the caller's, s = t - t of entry into the grid. Steps are taken in s, so that they stay
// exact for origins that are far away.
#include "bvh/brick_volume.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "base/nonfinite.h"
#include "base/split_mix.h"

namespace farfield {

namespace {

// Six-byte matrices have eigenvalues up to 1 + 1/127 (docs/theory.md, section 10.10), so sigma may reach its square
// root.
constexpr float kSigmaBound = 1.00393f;

/// Random numbers of one flight.
class FlightRandom {
 public:
  FlightRandom(uint64_t seed, float share) : bits_(seed), per_depth_(1.0f / share) {}
  float uniform() { return to_unit_float(bits_.next()); }
  /// Of the whole medium: where only a share of it is there, a flight goes so much deeper.
  float optical_depth() { return -std::log(1.0f - uniform()) * per_depth_; }  // 24 bits: exact, and not 0

 private:
  SplitMix bits_;
  float per_depth_;
};

int clamped_cell(float coordinate, int count) {
  // The negated comparison also sends NaN to 0; the conversion is in range after it.
  if (!(coordinate > 0.0f)) return 0;
  return coordinate < static_cast<float>(count) ? static_cast<int>(coordinate) : count - 1;
}

/// The walk over the cells of one grid level: which cell, and where the ray crosses into the next along each axis.
struct Walk {
  ivec3 cell;
  vec3 next;  ///< s of the next crossing; infinity along axes that the ray does not move in

  /// origin: cell (0,0,0)'s lower corner on the ray's scale; side: of a cell.
  Walk(const vec3& entry, const vec3& direction, const vec3& inverse, const vec3& origin, float side, float s_begin,
       const ivec3& count) {
    const vec3 p = (entry + s_begin * direction - origin) * (1.0f / side);  // sides are powers of two
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = clamped_cell(p[axis], count[axis]);
      const float plane = origin[axis] + side * static_cast<float>(cell[axis] + (direction[axis] > 0.0f ? 1 : 0));
      next[axis] = std::isinf(inverse[axis]) ? kInfinity : (plane - entry[axis]) * inverse[axis];
    }
  }
  float exit() const { return std::min(next.x, std::min(next.y, next.z)); }
  /// Goes to the next cell; selects instead of branches and indices [measured: 1.3-1.6x]. False: outside the grid.
  bool step(const ivec3& sign, const vec3& delta, const ivec3& count) {
    const bool along_x = next.x <= next.y && next.x <= next.z;
    const bool along_y = !along_x && next.y <= next.z;
    const bool along_z = !along_x && !along_y;
    cell.x += along_x ? sign.x : 0;
    cell.y += along_y ? sign.y : 0;
    cell.z += along_z ? sign.z : 0;
    next.x += along_x ? delta.x : 0.0f;
    next.y += along_y ? delta.y : 0.0f;
    next.z += along_z ? delta.z : 0.0f;
    const auto inside = [](int i, int n) { return static_cast<unsigned>(i) < static_cast<unsigned>(n); };
    return inside(cell.x, count.x) & inside(cell.y, count.y) & inside(cell.z, count.z);
  }
};

}  // namespace

/// A ray's way through the grid; lengths in voxels.
struct BrickVolume::Flight {
  vec3 entry;           ///< where s = 0
  vec3 direction;       ///< per unit of t
  vec3 inverse;         ///< 1 / direction
  ivec3 sign;           ///< of direction
  vec3 delta;           ///< s between crossings of voxel planes; infinity along axes that the ray does not move in
  vec3 unit_direction;  ///< of the ray in local space
  float speed;          ///< |local direction|: scene units per unit of t
  float depth_left;     ///< optical depth until the next tentative collision
  FlightRandom random;
  float s_hit = 0;
  uint32_t payload_hit = 0;
  float rate_hit = 0;  ///< of true attenuation there, per s
};

BrickVolume::BrickVolume(const LevelView& level)
    : brick_table_(level.brick_table),
      bricks_(level.bricks),
      voxel_sggx_(level.voxel_sggx),
      voxel_octants_(level.voxel_octants),
      brick_dims_(level.header.brick_dims),
      origin_(level.header.volume_origin),
      inverse_voxel_size_(1.0f / level.header.resolution) {
  find_what_is_occupied(level);
}

void BrickVolume::find_what_is_occupied(const LevelView& level) {
  for_each_brick(level, [&](const Brick& brick, const ivec3& coordinates) {
    const Box3 voxels = active_box(brick);
    if (voxels.is_empty()) return;
    const vec3 corner(coordinates * kBrickSide);
    occupied_.extend(Box3{corner + voxels.lower, corner + voxels.upper});
    densest_scale_ = std::max(densest_scale_, brick.density_scale);
  });
  if (!(densest_scale_ > 0)) bricks_ = {};  // nothing that a ray could meet
}

float BrickVolume::attenuation_bound() const { return voxel_sggx_.empty() ? 1.0f : kSigmaBound; }

float BrickVolume::projected_area(uint32_t payload, const vec3& unit_direction) const {
  if (voxel_sggx_.empty()) return 1.0f;
  return std::sqrt(std::max(0.0f, unpack(voxel_sggx_[payload]).quadratic(unit_direction)));
}

PackedOctants BrickVolume::octants_of(uint32_t payload) const {
  return voxel_octants_.empty() ? kFullOctants : voxel_octants_[payload];
}

// A real collision in the rest of a voxel where a tentative one was not. rate: of a full octant, per s; entry: as the
// flight's, from the corner of the brick.
bool BrickVolume::cross_octants(Flight& flight, const ivec3& voxel, const vec3& entry, float rate, float s_begin,
                                float s_end) const {
  const PackedOctants octants = octants_of(flight.payload_hit);
  float depth_left = flight.random.optical_depth();
  return !walk_octants(entry, flight.direction, flight.inverse, voxel, s_begin, s_end,
                       [&](int octant, float enter, float leave) {
                         const float rate_here = rate * octant_share(octants, octant);
                         const float depth = rate_here * (leave - enter);
                         if (depth_left < depth) {
                           flight.s_hit = enter + depth_left / rate_here;
                           flight.rate_hit = rate_here;
                           return false;
                         }
                         depth_left -= depth;
                         return true;
                       });
}

bool BrickVolume::cross_brick(Flight& flight, const Brick& brick, const ivec3& brick_cell, float s_begin,
                              float s_end) const {
  static const ivec3 kSide(kBrickSide);
  const float bound = attenuation_bound();
  const float rate_per_density = brick.density_scale * (1.0f / 255.0f) * flight.speed;  // of true attenuation, per s
  const vec3 corner = vec3(brick_cell * kBrickSide);
  Walk walk(flight.entry, flight.direction, flight.inverse, corner, 1.0f, s_begin, kSide);
  for (float s = s_begin;;) {
    const float s_next = std::min(walk.exit(), s_end);
    const int voxel = walk.cell.x + kBrickSide * (walk.cell.y + kBrickSide * walk.cell.z);
    const uint8_t density = brick.density[static_cast<size_t>(voxel)];
    if (density != 0 && s_next > s) {
      const float rate = static_cast<float>(density) * rate_per_density * bound;
      const float depth = rate * (s_next - s);
      if (depth < flight.depth_left) {
        flight.depth_left -= depth;
      } else {
        flight.s_hit = s + flight.depth_left / rate;
        flight.payload_hit = brick.payload_index(voxel);
        const float sigma = projected_area(flight.payload_hit, flight.unit_direction) / bound;
        const vec3 entry = flight.entry - corner;
        const int octant = octant_at(entry + flight.s_hit * flight.direction, walk.cell);
        const float acceptance = sigma * octant_share(octants_of(flight.payload_hit), octant);
        if (acceptance >= 1.0f || flight.random.uniform() < acceptance) {
          flight.rate_hit = rate * acceptance;
          return true;
        }
        if (cross_octants(flight, walk.cell, entry, rate * sigma, flight.s_hit, s_next)) return true;
        flight.depth_left = flight.random.optical_depth();
      }
    }
    if (s_next >= s_end || !walk.step(flight.sign, flight.delta, kSide)) return false;
    s = std::max(s, s_next);
  }
}

// Flies with the attenuation that the brick has at most; a tentative collision is real as often as the voxel's own is
// of that.
bool BrickVolume::skim_brick(Flight& flight, const Brick& brick, const ivec3& brick_cell, float s_begin,
                             float s_end) const {
  const float bound = attenuation_bound();
  const float rate = brick.density_scale * bound * flight.speed;
  const vec3 corner = vec3(brick_cell * kBrickSide);
  for (float s = s_begin;;) {
    const float depth_to_end = rate * (s_end - s);
    if (depth_to_end <= flight.depth_left) {
      flight.depth_left -= depth_to_end;
      return false;
    }
    s += flight.depth_left / rate;
    flight.depth_left = flight.random.optical_depth();
    const vec3 p = flight.entry + s * flight.direction - corner;
    const ivec3 cell(clamped_cell(p.x, kBrickSide), clamped_cell(p.y, kBrickSide), clamped_cell(p.z, kBrickSide));
    const int voxel = cell.x + kBrickSide * (cell.y + kBrickSide * cell.z);
    const float share = static_cast<float>(brick.density[static_cast<size_t>(voxel)]) * (1.0f / 255.0f);
    const float u = flight.random.uniform();
    if (!(u < share)) continue;
    flight.s_hit = s;
    flight.payload_hit = brick.payload_index(voxel);
    const float share_here = share * octant_share(octants_of(flight.payload_hit), octant_at(p, cell));
    const float area = share_here * projected_area(flight.payload_hit, flight.unit_direction);
    if (u * bound < area) {
      flight.rate_hit = brick.density_scale * flight.speed * area;
      return true;
    }
  }
}

/// The part of a ray that may meet something; in voxels, s = 0 at range.t_near.
struct BrickVolume::Course {
  RayRange range;
  vec3 entry;      ///< where s = 0
  vec3 direction;  ///< per unit of t
  float speed;     ///< scene units per unit of t
  float s_end;

  vec3 inverse() const { return 1.0f / direction; }
  ivec3 sign() const {
    const auto of = [](float x) { return x > 0.0f ? 1 : -1; };
    return {of(direction.x), of(direction.y), of(direction.z)};
  }
  /// s between planes.
  static vec3 delta(const vec3& inverse) {
    return {std::abs(inverse.x), std::abs(inverse.y), std::abs(inverse.z)};  // glm::abs branches
  }
};

/// False: there is none.
inline bool BrickVolume::find_course(const LocalRay& ray, Course& course) const {
  if (is_empty()) return false;
  const LocalRay in_voxels{(ray.origin - origin_) * inverse_voxel_size_, ray.direction * inverse_voxel_size_,
                           ray.t_near, ray.t_far};
  if (!is_traceable(in_voxels)) return false;
  const RayRange range = clip_to_box(in_voxels, occupied_);
  if (range.is_empty() || !std::isfinite(range.t_far)) return false;  // an infinite range has no direction

  const float speed = glm::length(ray.direction);
  if (!(speed > 0.0f && speed < kInfinity)) return false;
  course = {range, in_voxels.origin + range.t_near * in_voxels.direction, in_voxels.direction, speed,
            range.t_far - range.t_near};
  return true;
}

std::optional<VolumeHit> BrickVolume::first_collision(const LocalRay& ray, uint64_t seed, float share) const {
  Course course;
  if (!find_course(ray, course)) return std::nullopt;
  FlightRandom random(seed, share);
  const float depth = random.optical_depth();
  const RayRange& range = course.range;
  const float s_end = course.s_end, bound = attenuation_bound() * course.speed;
  if (densest_scale_ * bound * s_end < depth) return std::nullopt;

  const vec3 inverse = course.inverse();
  Flight flight{course.entry,
                course.direction,
                inverse,
                course.sign(),
                Course::delta(inverse),
                ray.direction / course.speed,
                course.speed,
                depth,
                random};
  const vec3 brick_delta = flight.delta * static_cast<float>(kBrickSide);
  Walk walk(flight.entry, flight.direction, flight.inverse, vec3(0.0f), static_cast<float>(kBrickSide), 0.0f,
            brick_dims_);
  for (float s = 0.0f;;) {
    const float s_exit = walk.exit(), s_next = std::min(s_exit, s_end);
    const uint32_t index = brick_table_[brick_table_index(brick_dims_, walk.cell)];
    if (index != kNoBrick && s_next > s) {
      const Brick& brick = bricks_[index];
      // By the whole chord, so that where the ray ends changes nothing before.
      const bool is_faint = brick.density_scale * bound * (s_exit - s) <= kMostSkimmed;
      const bool hits =
          is_faint ? skim_brick(flight, brick, walk.cell, s, s_next) : cross_brick(flight, brick, walk.cell, s, s_next);
      if (hits) {
        return VolumeHit{std::min(range.t_near + flight.s_hit, range.t_far), flight.payload_hit,
                         flight.rate_hit * share};
      }
    }
    if (s_next >= s_end || !walk.step(flight.sign, brick_delta, brick_dims_)) return std::nullopt;
    s = std::max(s, s_next);
  }
}

float BrickVolume::depth_of_brick(const Course& course, const Brick& brick, const ivec3& brick_cell, float s_begin,
                                  float s_end) const {
  static const ivec3 kSide(kBrickSide);
  const vec3 corner = vec3(brick_cell * kBrickSide), inverse = course.inverse(), delta = Course::delta(inverse);
  const vec3 unit_direction = glm::normalize(course.direction);
  const float rate_per_density = brick.density_scale * (1.0f / 255.0f) * course.speed;
  const ivec3 sign = course.sign();
  float sum = 0;
  Walk walk(course.entry, course.direction, inverse, corner, 1.0f, s_begin, kSide);
  for (float s = s_begin;;) {
    const float s_next = std::min(walk.exit(), s_end);
    const int voxel = walk.cell.x + kBrickSide * (walk.cell.y + kBrickSide * walk.cell.z);
    const uint8_t density = brick.density[static_cast<size_t>(voxel)];
    if (density != 0 && s_next > s) {
      const uint32_t payload = brick.payload_index(voxel);
      const PackedOctants octants = octants_of(payload);
      float length = 0;  // of it in full octants
      walk_octants(course.entry - corner, course.direction, inverse, walk.cell, s, s_next,
                   [&](int octant, float enter, float leave) {
                     length += octant_share(octants, octant) * (leave - enter);
                     return true;
                   });
      sum += static_cast<float>(density) * rate_per_density * projected_area(payload, unit_direction) * length;
    }
    if (s_next >= s_end || !walk.step(sign, delta, kSide)) return sum;
    s = std::max(s, s_next);
  }
}

float BrickVolume::optical_depth(const LocalRay& ray) const {
  Course course;
  if (!find_course(ray, course)) return 0;
  const vec3 inverse = course.inverse(), brick_delta = Course::delta(inverse) * static_cast<float>(kBrickSide);
  const ivec3 sign = course.sign();
  float sum = 0;
  Walk walk(course.entry, course.direction, inverse, vec3(0.0f), static_cast<float>(kBrickSide), 0.0f, brick_dims_);
  for (float s = 0.0f;;) {
    const float s_next = std::min(walk.exit(), course.s_end);
    const uint32_t index = brick_table_[brick_table_index(brick_dims_, walk.cell)];
    if (index != kNoBrick && s_next > s) sum += depth_of_brick(course, bricks_[index], walk.cell, s, s_next);
    if (s_next >= course.s_end || !walk.step(sign, brick_delta, brick_dims_)) return sum;
    s = std::max(s, s_next);
  }
}

float BrickVolume::attenuation_at(const vec3& point, const vec3& direction) const {
  const float speed = glm::length(direction);
  const vec3 p = (point - origin_) * inverse_voxel_size_;
  const vec3 end = vec3(brick_dims_ * kBrickSide);
  const bool is_inside = p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < end.x && p.y < end.y && p.z < end.z;  // no NaN
  if (is_empty() || !is_inside || !(speed > 0.0f && speed < kInfinity)) return 0;
  const ivec3 cell(p), brick_cell = cell / kBrickSide, in_brick = cell % kBrickSide;
  const uint32_t index = brick_table_[brick_table_index(brick_dims_, brick_cell)];
  if (index == kNoBrick) return 0;
  const Brick& brick = bricks_[index];
  const int voxel = in_brick.x + kBrickSide * (in_brick.y + kBrickSide * in_brick.z);
  const uint8_t density = brick.density[static_cast<size_t>(voxel)];
  if (density == 0) return 0;
  const uint32_t payload = brick.payload_index(voxel);
  const float rho = static_cast<float>(density) * brick.density_scale * (1.0f / 255.0f);
  return rho * octant_share(octants_of(payload), octant_at(p, cell)) * projected_area(payload, direction / speed) *
         speed;
}

}  // namespace farfield
