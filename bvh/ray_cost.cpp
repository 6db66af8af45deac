// SPDX-License-Identifier: Apache-2.0
// The counted rays walk a BVH of our own, since Embree does not say what its rays look at, and the level's bricks.
// Both are simpler than what real rays do (binary nodes instead of eight children, flakes of no orientation): what has
// to be right is the order of an asset's levels by cost (docs/decisions/0020).
#include "bvh/ray_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/nonfinite.h"
#include "base/random.h"
#include "bvh/brick_volume.h"

namespace farfield {

namespace {

constexpr int kRays = 1 << 12;  // of each kind

// Least squares over the levels of five trees and two grounds (docs/results/speed.md); quads go with boxes.
constexpr double kRay = 55, kBox = 6, kQuad = 1, kBrick = 21, kVoxel = 12.5, kCollision = 66;

// What a flake shows on average over directions of its full area: one side of a flat one.
constexpr float kMeanArea = 0.5f;

// ---- surface ----

/// A binary BVH over quads, split by binned surface area [Wald 2007].
class QuadTree {
 public:
  explicit QuadTree(const LevelView& level) : level_(level), order_(level.quads.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (const Quad& quad : level.quads) {
      Box3 box;
      for (const uint32_t v : {quad.v0, quad.v1, quad.v2, quad.v3}) box.extend(level.positions[v]);
      boxes_.push_back(box);
    }
    if (!order_.empty()) build();
  }

  /// The nearest hit before t_far, or t_far. Adds what it looks at.
  float nearest_hit(const vec3& origin, const vec3& direction, float t_far, RayWork& work) const {
    if (nodes_.empty()) return t_far;
    const LocalRay ray{origin, direction, 0.0f, t_far};
    struct Entry {
      uint32_t node;
      float t_near;
    };
    std::vector<Entry>& stack = scratch<Entry>();
    stack.assign(1, {0, clip_to_box(ray, nodes_[0].box).t_near});
    while (!stack.empty()) {
      const auto [at, t_entry] = stack.back();
      stack.pop_back();
      if (t_entry > t_far) continue;
      const Node& node = nodes_[at];
      for (uint32_t i = node.begin; node.is_leaf() && i < node.end; ++i) {
        work.quads += 1;
        t_far = hit_quad(level_.quads[order_[i]], origin, direction, t_far);
      }
      if (node.is_leaf()) continue;
      work.boxes += 2;
      std::array<Entry, 2> children;
      for (uint32_t side = 0; side < 2; ++side) {
        const RayRange range = clip_to_box({origin, direction, 0.0f, t_far}, nodes_[node.child + side].box);
        children[side] = {node.child + side, range.is_empty() ? kInfinity : range.t_near};
      }
      if (children[0].t_near < children[1].t_near) std::swap(children[0], children[1]);  // the nearer one on top
      for (const Entry& child : children) {
        if (child.t_near < kInfinity) stack.push_back(child);
      }
    }
    return t_far;
  }

 private:
  static constexpr uint32_t kLeaf = 4;
  static constexpr int kBins = 16;

  struct Node {
    Box3 box;
    uint32_t begin, end;  // of order_
    uint32_t child = 0;   // the first of two; 0: a leaf
    bool is_leaf() const { return child == 0; }
  };

  template <typename T>
  static std::vector<T>& scratch() {
    thread_local std::vector<T> stack;
    return stack;
  }

  static float area(const Box3& box) {
    const vec3 s = box.size();
    return s.x * s.y + s.y * s.z + s.z * s.x;
  }

  void build() {
    nodes_.push_back({box_of(0, static_cast<uint32_t>(order_.size())), 0, static_cast<uint32_t>(order_.size())});
    for (size_t at = 0; at < nodes_.size(); ++at) {
      const Node node = nodes_[at];
      if (node.end - node.begin <= kLeaf) continue;
      const uint32_t middle = split(node.begin, node.end);
      nodes_[at].child = static_cast<uint32_t>(nodes_.size());
      nodes_.push_back({box_of(node.begin, middle), node.begin, middle});
      nodes_.push_back({box_of(middle, node.end), middle, node.end});
    }
  }

  Box3 box_of(uint32_t begin, uint32_t end) const {
    Box3 box;
    for (uint32_t i = begin; i < end; ++i) box.extend(boxes_[order_[i]]);
    return box;
  }

  /// Orders the quads so that those before the result are one child's.
  uint32_t split(uint32_t begin, uint32_t end) {
    Box3 centers;
    for (uint32_t i = begin; i < end; ++i) centers.extend(boxes_[order_[i]].center());
    const vec3 size = centers.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    const uint32_t halves = begin + (end - begin) / 2;
    if (!(size[axis] > 0)) return halves;  // all in one place

    const float scale = kBins * 0.9999f / size[axis];
    const auto bin_of = [&](uint32_t quad) {
      return std::clamp(static_cast<int>((boxes_[quad].center()[axis] - centers.lower[axis]) * scale), 0, kBins - 1);
    };
    const int best = cheapest_bin(begin, end, bin_of);
    const auto middle = std::stable_partition(order_.begin() + begin, order_.begin() + end,
                                              [&](uint32_t quad) { return bin_of(quad) < best; });
    const auto at = static_cast<uint32_t>(middle - order_.begin());
    return at == begin || at == end ? halves : at;
  }

  /// The bin before which to split.
  template <typename BinOf>
  int cheapest_bin(uint32_t begin, uint32_t end, BinOf bin_of) const {
    std::array<Box3, kBins> boxes;
    std::array<uint32_t, kBins> counts{};
    for (uint32_t i = begin; i < end; ++i) {
      const int bin = bin_of(order_[i]);
      boxes[static_cast<size_t>(bin)].extend(boxes_[order_[i]]);
      ++counts[static_cast<size_t>(bin)];
    }
    std::array<float, kBins> right{};  // cost of all bins from here on
    Box3 box;
    uint32_t count = 0;
    const auto add = [&](size_t bin) {
      if (counts[bin] > 0) box.extend(boxes[bin]);
      count += counts[bin];
      return count > 0 ? area(box) * static_cast<float>(count) : 0.0f;
    };
    for (size_t bin = kBins; bin-- > 0;) right[bin] = add(bin);
    box = Box3();
    count = 0;
    int best = kBins / 2;
    float least = kInfinity;
    for (size_t bin = 1; bin < kBins; ++bin) {
      const float cost = add(bin - 1) + right[bin];
      if (cost < least) least = cost, best = static_cast<int>(bin);
    }
    return best;
  }

  float hit_quad(const Quad& quad, const vec3& origin, const vec3& direction, float t_far) const {
    for (uint32_t side = 0; side < (quad.is_pair() ? 2u : 1u); ++side) {
      const uvec3 face = quad.face(side);
      const vec3 a = level_.positions[face.x], ab = level_.positions[face.y] - a, ac = level_.positions[face.z] - a;
      const vec3 p = glm::cross(direction, ac);
      const float inverse = 1.0f / glm::dot(ab, p);
      const vec3 s = origin - a, q = glm::cross(s, ab);
      const float u = glm::dot(s, p) * inverse, v = glm::dot(direction, q) * inverse;
      const float t = glm::dot(ac, q) * inverse;
      if (u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < t_far) t_far = t;  // false for NaN
    }
    return t_far;
  }

  const LevelView& level_;
  std::vector<uint32_t> order_;
  std::vector<Box3> boxes_;
  std::vector<Node> nodes_;
};

// ---- volume ----

/// Walks a line through cells of one size: calls on_cell(cell, t_begin, t_end) from t_near on, until it says false.
template <typename OnCell>
bool walk_cells(const vec3& origin, const vec3& direction, const Box3& box, const ivec3& count, float side,
                float t_near, float t_far, OnCell on_cell) {
  const RayRange range = clip_to_box({origin, direction, t_near, t_far}, box);
  if (range.is_empty()) return true;
  const vec3 entry = (origin + range.t_near * direction - box.lower) / side;
  ivec3 cell;
  vec3 next, delta;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(std::floor(entry[axis])), 0, count[axis] - 1);
    const float plane = box.lower[axis] + side * static_cast<float>(cell[axis] + (direction[axis] > 0 ? 1 : 0));
    next[axis] = direction[axis] != 0 ? (plane - origin[axis]) / direction[axis] : kInfinity;
    delta[axis] = std::abs(side / direction[axis]);
  }
  for (float t = range.t_near; t < range.t_far;) {
    const int axis = next.x <= next.y && next.x <= next.z ? 0 : (next.y <= next.z ? 1 : 2);
    const float t_end = std::min(next[axis], range.t_far);
    if (!on_cell(cell, t, std::max(t, t_end))) return false;
    cell[axis] += direction[axis] > 0 ? 1 : -1;
    if (cell[axis] < 0 || cell[axis] >= count[axis]) break;
    next[axis] += delta[axis];
    t = t_end;
  }
  return true;
}

/// Attenuation of a voxel over flakes of no orientation and over its octants, as a share of its density's.
float mean_share_of(const LevelView& level, const Brick& brick, int voxel) {
  return kMeanArea * (level.voxel_octants.empty() ? 1.0f : mean_share(level.voxel_octants[brick.payload_index(voxel)]));
}

/// A level's volume as its rays see it: what is empty around it they do not walk.
class Volume {
 public:
  explicit Volume(const LevelView& level) : level_(level) {
    for_each_brick(level, [&](const Brick& brick, const ivec3& coordinates) {
      const Box3 voxels = active_box(brick);
      const vec3 corner = level.header.volume_origin + brick_side() * vec3(coordinates);
      occupied_.extend(
          Box3{corner + level.header.resolution * voxels.lower, corner + level.header.resolution * voxels.upper});
      densest_scale_ = std::max(densest_scale_, brick.density_scale);
    });
  }
  const LevelView& level() const { return level_; }
  float brick_side() const { return level_.header.resolution * kBrickSide; }
  const Box3& occupied() const { return occupied_; }
  float densest_scale() const { return densest_scale_; }

 private:
  const LevelView& level_;
  Box3 occupied_;
  float densest_scale_ = 0;
};

/// One ray through a volume.
class FreeFlight {
 public:
  FreeFlight(const Volume& volume, const vec3& origin, const vec3& direction, float depth, RayWork& work)
      : volume_(volume), origin_(origin), direction_(direction), depth_(depth), work_(work) {}

  /// Flies until the optical depth is used up. Where it ends, or t_far.
  float end(float t_far) {
    const LevelHeader& header = volume_.level().header;
    end_ = t_far;
    if (volume_.occupied().is_empty()) return end_;
    const RayRange range = clip_to_box({origin_, direction_, 0.0f, t_far}, volume_.occupied());
    if (range.is_empty() || volume_.densest_scale() * (range.t_far - range.t_near) < depth_) return end_;
    const float side = volume_.brick_side();
    const Box3 grid{header.volume_origin, header.volume_origin + vec3(header.brick_dims) * side};
    walk_cells(origin_, direction_, grid, header.brick_dims, side, range.t_near, range.t_far,
               [&](const ivec3& cell, float enter, float leave) { return cross_cell(cell, enter, leave); });
    return end_;
  }

 private:
  /// A cell of the brick table. False: the flight ends there.
  bool cross_cell(const ivec3& cell, float enter, float leave) {
    const LevelView& level = volume_.level();
    work_.bricks += 1;
    const uint32_t index = level.brick_table[brick_table_index(level.header.brick_dims, cell)];
    if (index == kNoBrick) return true;
    const Brick& brick = level.bricks[index];
    const float expected = brick.density_scale * (leave - enter);
    const bool is_faint = expected <= kMostSkimmed;
    if (is_faint) work_.collisions += static_cast<double>(expected);
    const vec3 corner = level.header.volume_origin + volume_.brick_side() * vec3(cell);
    return walk_cells(origin_, direction_, {corner, corner + volume_.brick_side()}, ivec3(kBrickSide),
                      level.header.resolution, enter, leave, [&](const ivec3& voxel, float from, float to) {
                        if (!is_faint) work_.voxels += 1;
                        return cross_voxel(brick, voxel, from, to, is_faint);
                      });
  }

  bool cross_voxel(const Brick& brick, const ivec3& voxel, float enter, float leave, bool is_faint) {
    const int i = voxel.x + kBrickSide * (voxel.y + kBrickSide * voxel.z);
    const uint8_t density = brick.density[static_cast<size_t>(i)];
    if (density == 0) return true;
    const float share = mean_share_of(volume_.level(), brick, i);
    const float rate = share * static_cast<float>(density) * brick.density_scale / 255.0f;
    if (!is_faint) work_.collisions += static_cast<double>(std::min(depth_, rate * (leave - enter)) / share);
    if (rate * (leave - enter) < depth_) {
      depth_ -= rate * (leave - enter);
      return true;
    }
    end_ = enter + depth_ / rate;
    return false;
  }

  const Volume& volume_;
  vec3 origin_, direction_;
  float depth_;  // optical, left
  float end_ = 0;
  RayWork& work_;
};

// ---- rays ----

vec3 random_direction(Rng& rng) {
  const float z = 2 * rng.next() - 1, angle = 6.2831853f * rng.next(), r = std::sqrt(std::max(0.0f, 1 - z * z));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace

RayWork count_ray_work(const LevelView& level) {
  RayWork work;
  const Box3& bounds = level.header.bounds;
  if (bounds.is_empty()) return work;
  const QuadTree surface(level);
  const Volume volume(level);
  const float size = glm::length(bounds.size());
  Rng rng(1);
  int rays = 0;
  /// Where the ray is stopped; infinity if it is not.
  const auto trace = [&](const vec3& origin, const vec3& direction, float depth) {
    ++rays;
    const float t = surface.nearest_hit(origin, direction, kInfinity, work);
    const float far = std::min(t, 4 * size);
    const float end = FreeFlight(volume, origin, direction, depth, work).end(far);
    return end < far ? end : t;
  };
  for (int i = 0; i < kRays; ++i) {
    const vec3 through = bounds.lower + bounds.size() * vec3(rng.next(), rng.next(), rng.next());
    const vec3 direction = random_direction(rng), onward = random_direction(rng);
    const float depth = -std::log(1 - rng.next()), onward_depth = -std::log(1 - rng.next());
    const vec3 origin = through - size * direction;
    const float t = trace(origin, direction, depth);
    if (t < kInfinity) trace(origin + t * direction + 1e-4f * size * onward, onward, onward_depth);
  }
  for (double* count : {&work.boxes, &work.quads, &work.bricks, &work.voxels, &work.collisions}) *count /= rays;
  return work;
}

double ray_cost(const RayWork& work) {
  return kRay + kBox * work.boxes + kQuad * work.quads + kBrick * work.bricks + kVoxel * work.voxels +
         kCollision * work.collisions;
}

}  // namespace farfield
