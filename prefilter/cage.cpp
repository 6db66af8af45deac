// SPDX-License-Identifier: Apache-2.0
#include "prefilter/cage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "base/hash.h"
#include "base/index.h"

namespace farfield {
namespace {

constexpr size_t kMostCorners = std::numeric_limits<int>::max();  // of all faces together
// Corners of a face, faces around a point: the limit surface of each such face is a sum over all of them, so that time
// grows with their square. 2048 take minutes. Of polygons, which are not smoothed, OpenSubdiv's own limit.
constexpr size_t kMostAroundSmoothed = 2048, kMostAround = 65535;

bool is_usable(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

/// The bits of numbers that are equal are equal.
template <typename Values>
uint64_t hash_of_numbers(const Values& values, uint64_t seed) {
  for (int c = 0; c < Values::length(); ++c) {
    const auto number = static_cast<double>(values[c]) + 0.0;  // -0 + 0 = 0
    uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    seed = mix64(seed, bits);
  }
  return seed;
}

/// For each position the first that is the same; without `join` itself.
std::vector<uint32_t> join_doubles(const SourceMesh& mesh, bool join) {
  std::vector<uint32_t> first(mesh.positions.size());
  std::unordered_multimap<uint64_t, uint32_t> by_hash;
  for (uint32_t v = 0; v < first.size(); ++v) {
    first[v] = v;
    if (!join) continue;
    const uint64_t hash = hash_of_numbers(mesh.positions[v], 0);
    const auto [begin, end] = by_hash.equal_range(hash);
    const auto same =
        std::find_if(begin, end, [&](const auto& entry) { return mesh.positions[entry.second] == mesh.positions[v]; });
    if (same == end) {
      by_hash.emplace(hash, v);
    } else {
      first[v] = same->second;
    }
  }
  return first;
}

uint64_t edge_key(int a, int b) {
  return static_cast<uint64_t>(std::min(a, b)) << 32 | static_cast<uint32_t>(std::max(a, b));
}

/// A face at an edge.
struct EdgeUse {
  uint32_t face = 0;
  bool is_forward = false;  ///< from the smaller point to the larger
};

/// The faces of each edge: of the first two who they are, of all how many.
struct CageEdge {
  EdgeUse use[2];
  uint32_t count = 0;

  bool winds_twice() const { return count == 2 && use[0].is_forward == use[1].is_forward; }
};

class CageBuilder {
 public:
  CageBuilder(SourceMesh& mesh, CageUse use, const std::string& name, const Job& job)
      : mesh_(mesh), is_smoothed_(use == CageUse::Smoothed), name_(name), job_(job) {}

  Result<Cage> build() {
    if (mesh_.corner_count() > kMostCorners) return unsupported("more than 2^31 corners of faces");
    point_of_ = join_doubles(mesh_, mesh_.is_split || !is_smoothed_);
    for (uint32_t face = 0; face < mesh_.face_count(); ++face) {
      if (job_.is_cancelled()) return make_error(ErrorCode::Cancelled, "import: cancelled");
      add_face(face);
    }
    say_what_was_dropped();
    if (cage_.face_size.empty()) return make_error(ErrorCode::BadFile, fmt::format("{}: has no usable faces", name_));
    if (largest_face_ > most_around()) {
      return unsupported(fmt::format("a face of {} corners; {} are the most of a cage", largest_face_, most_around()));
    }
    find_edges();
    wind_alike();
    say_what_stays_sharp();
    drop_unused_points();
    FARFIELD_TRY(check_neighbours());
    if (is_smoothed_) add_tags();
    if (!is_smoothed_) add_normals();
    share(mesh_.corner_uv, cage_.uv);
    share(mesh_.corner_color, cage_.color);
    measure();
    return std::move(cage_);
  }

 private:
  tl::unexpected<Error> unsupported(const std::string& what) const {
    return make_error(ErrorCode::Unsupported, fmt::format("{}: {}", name_, what));
  }

  size_t most_around() const { return is_smoothed_ ? kMostAroundSmoothed : kMostAround; }

  void warn(size_t count, const char* what) {
    if (count > 0) mesh_.warnings.push_back(fmt::format("{} {}", count, what));
  }

  // ---- faces

  void add_face(uint32_t face) {
    corners_.clear();
    const auto point = [&](uint32_t corner) { return point_of_[mesh_.corner_position[corner]]; };
    for (uint32_t i = mesh_.face_begin[face]; i < mesh_.face_begin[face + 1]; ++i) {
      if (corners_.empty() || point(i) != point(corners_.back())) corners_.push_back(i);
    }
    while (corners_.size() > 1 && point(corners_.front()) == point(corners_.back())) corners_.pop_back();
    std::vector<uint32_t> points;
    for (const uint32_t corner : corners_) points.push_back(point(corner));
    std::ranges::sort(points);
    if (!std::ranges::all_of(points, [&](uint32_t p) { return is_usable(mesh_.positions[p]); })) {
      ++not_finite_;
    } else if (points.size() < 3 || std::ranges::adjacent_find(points) != points.end()) {
      ++degenerate_;
    } else if (!seen_.insert(hash_values<uint32_t>(points)).second) {
      ++repeated_;
    } else {
      for (const uint32_t corner : corners_) {
        cage_.corner_point.push_back(static_cast<int>(point(corner)));
        corner_.push_back(corner);
      }
      cage_.face_size.push_back(static_cast<int>(corners_.size()));
      cage_.face.push_back(face);
      largest_face_ = std::max(largest_face_, corners_.size());
    }
  }

  void say_what_was_dropped() {
    warn(not_finite_, "faces of the cage have coordinates that are not finite; dropped");
    warn(degenerate_, "faces of the cage have fewer than three points, or one twice; dropped");
    warn(repeated_, "faces of the cage repeat an earlier one with the same points; dropped");
  }

  // ---- edges

  /// Calls visit(a, b) for each edge of a face, in its direction.
  template <typename Visit>
  void for_each_edge(size_t face, const Visit& visit) const {
    const size_t begin = face_begin_[face], count = static_cast<size_t>(cage_.face_size[face]);
    for (size_t i = 0; i < count; ++i) {
      visit(cage_.corner_point[begin + i], cage_.corner_point[begin + (i + 1) % count]);
    }
  }

  void find_edges() {
    face_begin_.assign(1, 0);
    for (const int size : cage_.face_size) face_begin_.push_back(face_begin_.back() + static_cast<size_t>(size));
    edges_.clear();
    for (uint32_t face = 0; face < cage_.face_size.size(); ++face) {
      for_each_edge(face, [&](int a, int b) {
        CageEdge& edge = edges_[edge_key(a, b)];
        if (edge.count < 2) edge.use[edge.count] = {face, a < b};
        ++edge.count;
      });
    }
  }

  /// Surfaces are two-sided here, so files may wind as they like; cages may not.
  void wind_alike() {
    if (std::ranges::none_of(edges_, [](const auto& entry) { return entry.second.winds_twice(); })) return;
    size_t turned = 0;
    for (const uint32_t face : faces_to_turn()) {
      ++turned;
      const auto begin = static_cast<std::ptrdiff_t>(face_begin_[face]);
      const auto end = static_cast<std::ptrdiff_t>(face_begin_[face + 1]);
      std::reverse(cage_.corner_point.begin() + begin, cage_.corner_point.begin() + end);
      std::reverse(corner_.begin() + begin, corner_.begin() + end);
    }
    warn(turned, "faces of the cage wind against their neighbours; turned round");
    find_edges();
  }

  /// The first face of each piece stays, and its neighbours follow.
  std::vector<uint32_t> faces_to_turn() const {
    enum class Wound : uint8_t { Unknown, AsIs, Turned };
    std::vector<Wound> wound(cage_.face_size.size(), Wound::Unknown);
    std::vector<uint32_t> queue, turned;
    for (uint32_t seed = 0; seed < wound.size(); ++seed) {
      if (wound[seed] != Wound::Unknown) continue;
      wound[seed] = Wound::AsIs;
      queue.assign(1, seed);
      for (size_t at = 0; at < queue.size(); ++at) {
        const uint32_t face = queue[at];
        for_each_edge(face, [&](int a, int b) {
          const CageEdge& edge = edges_.at(edge_key(a, b));
          if (edge.count != 2) return;
          const uint32_t next = edge.use[edge.use[0].face == face ? 1 : 0].face;
          if (wound[next] != Wound::Unknown) return;
          const bool is_turned = (wound[face] == Wound::Turned) != edge.winds_twice();
          wound[next] = is_turned ? Wound::Turned : Wound::AsIs;
          if (is_turned) turned.push_back(next);
          queue.push_back(next);
        });
      }
    }
    return turned;
  }

  void say_what_stays_sharp() {
    size_t crowded = 0, against = 0;
    for (const auto& [key, edge] : edges_) {
      crowded += edge.count > 2;
      against += edge.winds_twice();
    }
    if (!is_smoothed_) return;
    warn(crowded, "edges of the cage have more than two faces; the surface is sharp there");
    warn(against,
         "edges of the cage lie where it turns inside out, as a Moebius strip does; the surface is sharp there");
  }

  // ---- points

  void drop_unused_points() {
    number_of_.assign(mesh_.positions.size(), -1);
    for (int& point : cage_.corner_point) {
      int& number = number_of_[static_cast<size_t>(point)];
      if (number < 0) {
        number = static_cast<int>(cage_.points.size());
        cage_.points.push_back(mesh_.positions[static_cast<size_t>(point)]);
      }
      point = number;
    }
    find_edges();
  }

  Result<void> check_neighbours() const {
    std::vector<uint32_t> count(cage_.points.size(), 0);
    for (const int point : cage_.corner_point) ++count[static_cast<size_t>(point)];
    const uint32_t most = *std::ranges::max_element(count);
    if (most <= most_around()) return {};
    return unsupported(fmt::format("a point with {} faces; {} are the most of a cage", most, most_around()));
  }

  /// The cage's number of a point of the mesh; -1: no face has it.
  int number_of(uint32_t position) const { return number_of_[point_of_[position]]; }

  // ---- tags

  void add_tags() {
    const CageTags& tags = mesh_.cage;
    size_t lost = 0;
    for (size_t i = 0; i < tags.crease_edges.size(); ++i) {
      const int a = number_of(tags.crease_edges[i].x), b = number_of(tags.crease_edges[i].y);
      if (a < 0 || b < 0 || !edges_.contains(edge_key(a, b))) {
        ++lost;
        continue;
      }
      cage_.crease_points.insert(cage_.crease_points.end(), {a, b});
      cage_.crease_sharpness.push_back(std::min(tags.crease_sharpness[i], kInfiniteSharpness));
    }
    warn(lost, "creases lie where the cage has no edge; ignored");
    size_t lonely = 0;
    for (size_t i = 0; i < tags.sharp_vertices.size(); ++i) {
      const int point = number_of(tags.sharp_vertices[i]);
      lonely += point < 0;
      if (point < 0) continue;
      cage_.sharp_points.push_back(point);
      cage_.point_sharpness.push_back(std::min(tags.vertex_sharpness[i], kInfiniteSharpness));
    }
    warn(lonely, "sharp corners of the cage belong to no face; ignored");
    const std::unordered_set<uint32_t> holes(tags.holes.begin(), tags.holes.end());
    for (size_t face = 0; face < cage_.face.size(); ++face) {
      if (holes.contains(cage_.face[face])) cage_.holes.push_back(static_cast<int>(face));
    }
  }

  // ---- what lies at corners

  /// Where the mesh has no normal, the face's own.
  void add_normals() {
    for (size_t face = 0; face < cage_.face_size.size(); ++face) {
      const size_t begin = face_begin_[face], end = face_begin_[face + 1];
      const dvec3 own = own_normal(begin, end);
      for (size_t i = begin; i < end; ++i) {
        const dvec3 given(mesh_.corner_normal.empty() ? vec3(0.0f) : mesh_.corner_normal[corner_[i]]);
        const double length = glm::length(given);
        cage_.corner_normal.push_back(length > 0 && std::isfinite(length) ? given / length : own);
      }
    }
  }

  /// Of a polygon that need not be plane; 0: it has no area.
  dvec3 own_normal(size_t begin, size_t end) const {
    const auto point = [&](size_t i) { return cage_.points[static_cast<size_t>(cage_.corner_point[i])]; };
    dvec3 sum(0.0);
    for (size_t i = begin + 1; i + 1 < end; ++i) {
      sum += glm::cross(point(i) - point(begin), point(i + 1) - point(begin));
    }
    const double length = glm::length(sum);
    return length > 0 ? sum / length : dvec3(0.0);
  }

  /// A face with a value that is no number shares none: its neighbours would get it, too.
  template <int N, typename T>
  void share(const std::vector<glm::vec<N, T>>& corner, CageChannel<N>& channel) const {
    if (corner.empty()) return;
    std::unordered_multimap<uint64_t, int> by_hash;
    for (size_t face = 0; face < cage_.face_size.size(); ++face) {
      bool is_finite = true;
      for (size_t i = face_begin_[face]; i < face_begin_[face + 1]; ++i) {
        for (int c = 0; c < N; ++c) is_finite &= std::isfinite(corner[corner_[i]][c]);
      }
      for (size_t i = face_begin_[face]; i < face_begin_[face + 1]; ++i) {
        const glm::vec<N, double> value(corner[corner_[i]]);
        const auto point = static_cast<uint64_t>(cage_.corner_point[i]);
        const uint64_t hash = hash_of_numbers(value, mix64(point));
        const auto [begin, end] = by_hash.equal_range(hash);
        const bool is_new = !is_finite || begin == end;
        channel.corner_value.push_back(is_new ? static_cast<int>(channel.values.size()) : begin->second);
        if (!is_new) continue;
        if (is_finite) by_hash.emplace(hash, channel.corner_value.back());
        channel.values.push_back(value);
      }
    }
  }

  void measure() {
    dvec3 lower(INFINITY), upper(-INFINITY);
    for (const dvec3& p : cage_.points) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
    const dvec3 size = upper - lower;
    cage_.side = std::max(size.x, std::max(size.y, size.z));
  }

  SourceMesh& mesh_;
  bool is_smoothed_;
  const std::string& name_;
  const Job& job_;
  Cage cage_;
  std::vector<uint32_t> point_of_;  ///< per position of the mesh: the first that is the same
  std::vector<int> number_of_;      ///< per position of the mesh, if it is such a first one: its number in the cage
  std::vector<uint32_t> corner_;    ///< per corner of the cage: the mesh's
  std::vector<size_t> face_begin_;  ///< per face of the cage: its first corner
  std::vector<uint32_t> corners_;   ///< of the face at hand
  std::unordered_map<uint64_t, CageEdge> edges_;
  std::unordered_set<uint64_t> seen_;  ///< hashes of faces' points
  size_t not_finite_ = 0, degenerate_ = 0, repeated_ = 0, largest_face_ = 0;
};

}  // namespace

Result<Cage> make_cage(SourceMesh& mesh, CageUse use, const std::string& name, const Job& job) {
  return CageBuilder(mesh, use, name, job).build();
}

}  // namespace farfield
