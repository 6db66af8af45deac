// SPDX-License-Identifier: Apache-2.0
// [Loubet 2018, 8.4; Daniels et al. 2008]. Candidates wait in a queue by their cost. The first is looked at again, as
// collapses before it may have changed it; it collapses if it is still the first (8.4.7).
#include "prefilter/collapse_loops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <queue>
#include <unordered_map>
#include <utility>

#include "base/index.h"
#include "base/parallel.h"
#include "prefilter/collapse_limits.h"
#include "prefilter/disjoint_sets.h"
#include "prefilter/face_loops.h"
#include "prefilter/material_filter.h"
#include "prefilter/quad_part.h"
#include "prefilter/surface_parts.h"
#include "prefilter/vertex_fan.h"
#include "prefilter/vertex_placement.h"

namespace farfield {
namespace {

constexpr double kMeanRung = 0.36;    ///< as edges are: mean width of loops that collapse, as a part of the resolution
constexpr double kLongestRung = 0.6;  ///< and the most that any place of it may be wide
constexpr double kLongSide = 0.72;    ///< no side of a face becomes longer than this part (8.4.5): twice as wide
constexpr double kWidthWeight = 2;    ///< of the mean width against the distance, each as a part of its limit
constexpr size_t kMostMerged = 9;     ///< vertices that become one: a loop that crosses itself beside itself

/// Marks of numbered things that are all taken away at once.
class Marks {
 public:
  explicit Marks(size_t count) : round_of_(count, 0) {}
  void clear() { ++round_; }
  bool has(uint32_t i) const { return round_of_[i] == round_; }
  /// False: it was there already.
  bool add(uint32_t i) { return std::exchange(round_of_[i], round_) != round_; }

 private:
  std::vector<uint32_t> round_of_;
  uint32_t round_ = 1;
};

/// How a vertex may move.
enum class VertexKind : uint8_t {
  Interior,
  Border,    ///< may go along the border
  Singular,  ///< several fans, an edge of several faces or too many faces meet here: loops at it stay
};

/// Collapses the loops of one part.
class LoopCollapser {
 public:
  LoopCollapser(QuadPart part, double resolution, const Job& job)
      : part_(std::move(part)),
        mesh_(part_.polygons, part_.positions.size()),
        resolution_(resolution),
        job_(job),
        vertex_marks_(part_.positions.size()),
        ring_marks_(part_.positions.size()),
        polygon_marks_(part_.polygons.size()),
        loop_marks_(part_.polygons.size()),
        group_of_(part_.positions.size(), 0) {
    merged_into.resize(part_.positions.size());
    std::iota(merged_into.begin(), merged_into.end(), 0u);
    deviation.assign(part_.positions.size(), 0.0);
    find_winding();
    find_kinds();
  }

  std::vector<uint32_t> merged_into;  ///< per vertex: itself while it lives, else a smaller one
  std::vector<double> deviation;      ///< per vertex
  const QuadPart& part() const { return part_; }
  bool is_alive(uint32_t polygon) const { return mesh_.is_alive(polygon); }

  void run() {
    for (const FaceLoop& loop : find_face_loops(mesh_)) {
      if (!job_.is_cancelled()) consider(loop);
    }
    // A loop that could not collapse may do so when its surroundings have changed.
    while (!job_.is_cancelled() && collapse_all_in_queue()) {
      for (const Seed& seed : std::exchange(refused_, {})) reconsider(seed);
    }
  }

 private:
  /// An edge that a loop crosses: where to find it again.
  struct Seed {
    uint32_t a, b;
  };
  struct Candidate {
    double cost;
    Seed seed;
    uint32_t when;  ///< how many had collapsed when the cost was found
    friend bool operator<(const Candidate& l, const Candidate& r) {
      if (l.cost != r.cost) return l.cost > r.cost;
      return l.seed.a != r.seed.a ? l.seed.a > r.seed.a : l.seed.b > r.seed.b;
    }
  };
  /// Vertices that become one, ascending: vertices_[begin] to vertices_[end - 1].
  struct Group {
    uint32_t begin, end;
    uint32_t target;  ///< the vertex of the side that stays
    uint32_t rungs = 0, border_rungs = 0;
    double longest_before = 0;
  };
  struct KeptTriangle {
    uint32_t polygon;
    int half;
    uvec3 vertices;  ///< after the collapse
  };

  // ---- the queue

  uint32_t root(uint32_t v) const {
    while (merged_into[v] != v) v = merged_into[v];
    return v;
  }

  std::optional<FaceLoop> find_again(const Seed& seed) const {
    const uint32_t a = root(seed.a), b = root(seed.b);
    if (a == b) return std::nullopt;
    for (const uint32_t polygon : mesh_.star(a)) {
      const int corner = mesh_.is_quad(polygon) ? mesh_.edge_corner(polygon, a, b) : -1;
      if (corner >= 0) return trace_loop(mesh_, polygon, corner);
    }
    return std::nullopt;
  }

  void consider(const FaceLoop& loop) {
    const Seed seed{loop.rungs.front().left, loop.rungs.front().right};
    const auto cost = cheaper_side(loop);
    if (cost) {
      queue_.push({cost->first, seed, collapse_count_});
    } else {
      refused_.push_back(seed);
    }
  }

  void reconsider(const Seed& seed) {
    if (const auto loop = find_again(seed)) consider(*loop);
  }

  /// True: some did collapse.
  bool collapse_all_in_queue() {
    const uint32_t before = collapse_count_;
    while (!queue_.empty() && !job_.is_cancelled()) {
      const Candidate candidate = queue_.top();
      queue_.pop();
      const auto loop = find_again(candidate.seed);
      if (!loop) continue;
      const auto cost = cheaper_side(*loop);
      if (!cost) {
        refused_.push_back(candidate.seed);
      } else if (candidate.when != collapse_count_ && !queue_.empty() && cost->first > queue_.top().cost) {
        queue_.push({cost->first, candidate.seed, collapse_count_});
      } else {
        plan(*loop, cost->second);
        commit(*loop);
      }
    }
    return collapse_count_ != before;
  }

  /// What it costs to collapse the loop, and whether to its left side. Nothing: it cannot.
  std::optional<std::pair<double, bool>> cheaper_side(const FaceLoop& loop) {
    const auto width = width_of(loop);
    if (!width) return std::nullopt;
    const auto left = plan(loop, true);
    const auto right = plan(loop, false);
    if (!left && !right) return std::nullopt;
    const bool to_left = left && (!right || *left <= *right);
    const double distance = to_left ? *left : *right;
    const double cost = distance / kMaxDeviation + kWidthWeight * *width / kMeanRung;
    return std::pair(cost / resolution_, to_left);
  }

  /// The mean width; nothing: too wide, or not to collapse at all.
  std::optional<double> width_of(const FaceLoop& loop) const {
    if (loop.is_twisted || loop.before == QuadMesh::kNotManifold || loop.after == QuadMesh::kNotManifold) {
      return std::nullopt;
    }
    double sum = 0;
    for (const Rung& rung : loop.rungs) {
      const double length = glm::length(part_.positions[rung.left] - part_.positions[rung.right]);
      if (!(length < kLongestRung * resolution_)) return std::nullopt;
      if (kind_[rung.left] == VertexKind::Singular || kind_[rung.right] == VertexKind::Singular) return std::nullopt;
      sum += length;
    }
    const double mean = sum / static_cast<double>(loop.rungs.size());
    if (!(mean < kMeanRung * resolution_)) return std::nullopt;
    return mean;
  }

  // ---- what a collapse would do

  /// Fills the members that say what becomes of the loop. Returns the largest distance to the input; nothing: it must
  /// not collapse so.
  std::optional<double> plan(const FaceLoop& loop, bool to_left) {
    if (!group_vertices(loop, to_left) || !gather_polygons()) return std::nullopt;
    place();
    if (!keeps_shape() || !keeps_topology()) return std::nullopt;
    double largest = 0;
    deviations_.clear();
    for (uint32_t g = 0; g < groups_.size(); ++g) {
      fill_ring(g);
      double old = 0;
      for (const uint32_t v : vertices_of(groups_[g])) old = std::max(old, deviation[v]);
      deviations_.push_back(old + deviation_at(ring_, new_positions_[g]));
      largest = std::max(largest, deviations_.back());
    }
    if (!(largest <= kMaxDeviation * resolution_)) return std::nullopt;
    return largest;
  }

  std::span<const uint32_t> vertices_of(const Group& group) const {
    return std::span(vertices_).subspan(group.begin, group.end - group.begin);
  }

  /// Which vertices become one, and which of them is on the side that stays. False: there is no such side.
  bool group_vertices(const FaceLoop& loop, bool to_left) {
    vertex_marks_.clear();
    std::vector<uint32_t>& found = vertices_;
    found.clear();
    for (const Rung& rung : loop.rungs) {
      for (const uint32_t v : {rung.left, rung.right}) {
        if (vertex_marks_.add(v)) found.push_back(v);
      }
    }
    std::sort(found.begin(), found.end());
    for (uint32_t i = 0; i < found.size(); ++i) group_of_[found[i]] = i;
    DisjointSets sets(found.size());
    std::vector<uint8_t> leaves(found.size(), 0);
    for (const Rung& rung : loop.rungs) {
      sets.join(group_of_[rung.left], group_of_[rung.right]);
      leaves[group_of_[to_left ? rung.right : rung.left]] = 1;
    }

    // Sorted by group, in each ascending.
    std::vector<std::pair<uint32_t, uint32_t>> order;
    for (uint32_t i = 0; i < found.size(); ++i) order.emplace_back(sets.least_of(i), i);
    std::sort(order.begin(), order.end());
    groups_.clear();
    std::vector<uint32_t> sorted;
    for (const auto& [least, i] : order) {
      if (least == i) groups_.push_back({static_cast<uint32_t>(sorted.size()), 0, kNoIndex});
      Group& group = groups_.back();
      sorted.push_back(found[i]);
      group.end = static_cast<uint32_t>(sorted.size());
      if (leaves[i]) continue;
      if (group.target != kNoIndex) return false;
      group.target = found[i];
    }
    vertices_ = std::move(sorted);
    for (uint32_t g = 0; g < groups_.size(); ++g) {
      for (const uint32_t v : vertices_of(groups_[g])) group_of_[v] = g;
    }
    return note_rungs(loop) && std::ranges::all_of(groups_, [&](const Group& group) { return is_group_valid(group); });
  }

  /// False: what becomes one vertex is not a disk, so a hole or a handle would go.
  bool note_rungs(const FaceLoop& loop) {
    for (size_t i = 0; i < loop.rungs.size(); ++i) {
      const Rung& rung = loop.rungs[i];
      Group& group = groups_[group_of_[rung.left]];
      ++group.rungs;
      const bool is_border = !loop.is_closed && ((i == 0 && loop.before == kNoIndex) ||
                                                 (i + 1 == loop.rungs.size() && loop.after == kNoIndex));
      group.border_rungs += is_border;
    }
    loop_marks_.clear();
    crossings_.assign(groups_.size(), 0);
    for (const uint32_t quad : loop.quads) {
      if (!loop_marks_.add(quad)) ++crossings_[group_of_[mesh_.face(quad).x]];
    }
    for (const uint32_t end : {loop.before, loop.after}) {
      if (end != kNoIndex) loop_marks_.add(end);
    }
    for (uint32_t g = 0; g < groups_.size(); ++g) {
      if (groups_[g].end - groups_[g].begin + crossings_[g] != groups_[g].rungs + 1) return false;
    }
    return true;
  }

  /// Borders merge only along themselves, and stay where they are otherwise.
  bool is_group_valid(const Group& group) const {
    if (group.target == kNoIndex || group.end - group.begin > kMostMerged) return false;
    const auto vertices = vertices_of(group);
    const auto borders = std::ranges::count_if(vertices, [&](uint32_t v) { return kind_[v] == VertexKind::Border; });
    if (borders == 0) return true;
    return kind_[group.target] == VertexKind::Border && group.border_rungs + 1 == borders;
  }

  bool is_merging(uint32_t vertex) const { return vertex_marks_.has(vertex); }
  uint32_t mapped(uint32_t v) const { return is_merging(v) ? vertices_[groups_[group_of_[v]].begin] : v; }
  bool collapses(uint32_t polygon) const { return loop_marks_.has(polygon); }

  /// The polygons around the loop. False: one would collapse that is not of the loop, or one of the loop would not.
  bool gather_polygons() {
    polygon_marks_.clear();
    affected_.clear();
    kept_.clear();
    for (const uint32_t v : vertices_) {
      for (const uint32_t polygon : mesh_.star(v)) {
        if (polygon_marks_.add(polygon)) affected_.push_back(polygon);
      }
    }
    std::sort(affected_.begin(), affected_.end());
    for (const uint32_t polygon : affected_) {
      const int count = corner_count(mesh_.face(polygon));
      const int left = distinct_corners(polygon);
      if (collapses(polygon)) {
        if (left > 2) return false;
        continue;
      }
      if (left != count) return false;
      visit_halves(mesh_.face(polygon), [&](int half, const uvec3& t) {
        kept_.push_back({polygon, half, {mapped(t.x), mapped(t.y), mapped(t.z)}});
      });
    }
    return !kept_.empty();
  }

  int distinct_corners(uint32_t polygon) const {
    const PolygonCorners& corners = mesh_.face(polygon);
    int distinct = 0;
    for (int c = 0; c < corner_count(corners); ++c) {
      int d = 0;
      while (d < c && mapped(corners[d]) != mapped(corners[c])) ++d;
      distinct += d == c;
    }
    return distinct;
  }

  // ---- geometry

  /// Of a vertex after the collapse.
  dvec3 after(uint32_t v) const { return is_merging(v) ? new_positions_[group_of_[v]] : part_.positions[v]; }

  Corners corners_at(const uvec3& t) const {
    return {part_.positions[t.x], part_.positions[t.y], part_.positions[t.z]};
  }

  double area_after() const {
    double area = 0;
    for (const auto& [polygon, half, t] : kept_) {
      area += glm::length(area_vector({after(t.x), after(t.y), after(t.z)}));
    }
    return area;
  }

  /// Merged vertices go to the side that stays, and from there towards the place that encloses the same volume (at a
  /// border: the same area in its plane), all by the same part of the way: until the area is the one before, as in
  /// restore_area().
  void place() {
    double before = 0;
    for (const uint32_t polygon : affected_) {
      visit_halves(mesh_.face(polygon),
                   [&](int, const uvec3& t) { before += glm::length(area_vector(corners_at(t))); });
    }
    new_positions_.clear();
    for (const Group& group : groups_) new_positions_.push_back(part_.positions[group.target]);
    const double at_target = area_after();
    std::vector<dvec3> way;
    for (uint32_t g = 0; g < groups_.size(); ++g) way.push_back(limit_of(g) - new_positions_[g]);
    const std::vector<dvec3> targets = new_positions_;
    for (size_t g = 0; g < way.size(); ++g) new_positions_[g] = targets[g] + way[g];
    const double at_limit = area_after();
    const double part =
        at_limit == at_target ? 0.0 : std::clamp((before - at_target) / (at_limit - at_target), 0.0, 1.0);
    for (size_t g = 0; g < way.size(); ++g) new_positions_[g] = targets[g] + part * way[g];
  }

  dvec3 limit_of(uint32_t g) {
    const Group& group = groups_[g];
    const dvec3 x = new_positions_[g];
    if (kind_[group.target] == VertexKind::Interior) {
      fill_ring(g);
      return with_same_volume(ring_, x);
    }
    if (group.border_rungs != 1 || group.end - group.begin != 2) return x;
    const uint32_t a = vertices_[group.begin], b = vertices_[group.begin + 1];
    const uint32_t p = border_neighbour(a, b), q = border_neighbour(b, a);
    if (p == kNoIndex || q == kNoIndex) return x;
    return with_same_border_area(after(p), part_.positions[a], part_.positions[b], after(q), x).value_or(x);
  }

  /// The vertex next to v along the border, other than `excluded`.
  uint32_t border_neighbour(uint32_t v, uint32_t excluded) const {
    for (const uint32_t polygon : mesh_.star(v)) {
      const PolygonCorners& corners = mesh_.face(polygon);
      const int count = corner_count(corners);
      for (int c = 0; c < count; ++c) {
        if (corners[c] != v) continue;
        for (const uint32_t next : {corners[(c + 1) % count], corners[(c + count - 1) % count]}) {
          if (next != excluded && mesh_.beyond(polygon, v, next) == kNoIndex) return next;
        }
      }
    }
    return kNoIndex;
  }

  /// The surface around a group before and after. Windings agree.
  void fill_ring(uint32_t g) {
    ring_.clear();
    ring_marks_.clear();
    const Group& group = groups_[g];
    const auto is_of_group = [&](uint32_t v) { return is_merging(v) && group_of_[v] == g; };
    const auto position = [&](uint32_t v) { return part_.positions[v]; };
    std::vector<uint32_t>& star = star_;
    star.clear();
    for (const uint32_t v : vertices_of(group)) star.insert(star.end(), mesh_.star(v).begin(), mesh_.star(v).end());
    std::sort(star.begin(), star.end());
    star.erase(std::unique(star.begin(), star.end()), star.end());
    for (const uint32_t v : vertices_of(group)) ring_.samples_before.push_back(position(v));
    for (const uint32_t polygon : star) {
      visit_halves(mesh_.face(polygon), [&](int, uvec3 t) {
        if (is_flipped_[polygon]) std::swap(t.y, t.z);
        const int c = is_of_group(t.x) ? 0 : is_of_group(t.y) ? 1 : is_of_group(t.z) ? 2 : -1;
        if (c < 0) return;
        ring_.before.push_back({position(t.x), position(t.y), position(t.z)});
        const uint32_t q = t[(c + 1) % 3], s = t[(c + 2) % 3];
        if (!collapses(polygon)) ring_.after.push_back({after(q), after(s)});
        for (const uint32_t v : {q, s}) {
          ring_.samples_before.push_back(0.5 * (position(t[c]) + position(v)));
          if (!is_of_group(v) && ring_marks_.add(mapped(v))) ring_.neighbours_after.push_back(after(v));
        }
      });
    }
  }

  bool keeps_shape() {
    for (Group& group : groups_) {
      group.longest_before = 0;
      for (const uint32_t v : vertices_of(group)) group.longest_before = std::max(group.longest_before, longest_at(v));
    }
    for (const auto& [polygon, half, t] : kept_) {
      if (!keeps_face(corners_at(half_of(mesh_.face(polygon), half)), {after(t.x), after(t.y), after(t.z)}))
        return false;
    }
    return std::ranges::all_of(affected_,
                               [&](uint32_t polygon) { return collapses(polygon) || has_short_sides(polygon); });
  }

  double longest_at(uint32_t v) const {
    double longest2 = 0;
    for (const uint32_t polygon : mesh_.star(v)) {
      const PolygonCorners& corners = mesh_.face(polygon);
      for (int c = 0; c < corner_count(corners); ++c) {
        const uint32_t next = corners[(c + 1) % corner_count(corners)];
        if (corners[c] != v && next != v) continue;
        longest2 = std::max(longest2, squared_length(part_.positions[next] - part_.positions[corners[c]]));
      }
    }
    return std::sqrt(longest2);
  }

  /// Where the source is coarser than the resolution, sides may grow a little: a tube's loops could not merge
  /// otherwise.
  bool has_short_sides(uint32_t polygon) const {
    const PolygonCorners& corners = mesh_.face(polygon);
    const int count = corner_count(corners);
    for (int c = 0; c < count; ++c) {
      const uint32_t v = corners[c], w = corners[(c + 1) % count];
      if (!is_merging(v) && !is_merging(w)) continue;
      const double limit = kLongSide * resolution_;
      double longest = 0;
      for (const uint32_t end : {v, w}) {
        if (is_merging(end)) longest = std::max(longest, groups_[group_of_[end]].longest_before);
      }
      const double width = 0.5 * kLongestRung * resolution_;
      const double allowed = longest > limit ? longest + width : limit;
      if (squared_length(after(w) - after(v)) > allowed * allowed) return false;
    }
    return true;
  }

  // ---- topology

  /// Whether around every vertex that is touched there is still one fan of triangles: closed inside, open at borders.
  /// With note_rungs() this is what the link condition is for one edge [Daniels et al. 2008; 8.4.6].
  bool keeps_topology() {
    ring_marks_.clear();
    for (const uint32_t polygon : affected_) {
      const PolygonCorners& corners = mesh_.face(polygon);
      for (int c = 0; c < corner_count(corners); ++c) {
        const uint32_t v = mapped(corners[c]);
        if (ring_marks_.add(v) && !has_one_fan(corners[c])) return false;
      }
    }
    return true;
  }

  bool has_one_fan(uint32_t v) {
    link_.clear();
    bool is_border = kind_[v] == VertexKind::Border;
    if (is_merging(v)) {
      for (const uint32_t w : vertices_of(groups_[group_of_[v]])) {
        add_link(w);
        is_border |= kind_[w] == VertexKind::Border;
      }
    } else {
      if (kind_[v] == VertexKind::Singular) return false;
      add_link(v);
    }
    return link_.size() <= 2 * kMaxStarFaces && is_one_fan(link_, is_border);
  }

  /// The edges that the triangles at v have opposite to it, after the collapse.
  void add_link(uint32_t v) {
    for (const uint32_t polygon : mesh_.star(v)) {
      if (collapses(polygon)) continue;
      visit_halves(mesh_.face(polygon), [&](int, const uvec3& t) {
        for (int c = 0; c < 3; ++c) {
          if (t[c] == v) link_.push_back({mapped(t[(c + 1) % 3]), mapped(t[(c + 2) % 3])});
        }
      });
    }
  }

  void find_kinds() {
    kind_.assign(part_.positions.size(), VertexKind::Interior);
    loop_marks_.clear();
    vertex_marks_.clear();
    for (uint32_t v = 0; v < kind_.size(); ++v) {
      if (mesh_.star(v).size() > kMaxStarFaces) {
        kind_[v] = VertexKind::Singular;
        continue;
      }
      link_.clear();
      add_link(v);
      std::vector<LinkEdge> copy = link_;
      if (is_one_fan(copy, false)) continue;
      copy = link_;
      kind_[v] = is_one_fan(copy, true) ? VertexKind::Border : VertexKind::Singular;
    }
  }

  /// Lets neighbouring polygons agree on a winding, outwards from the first of each sheet.
  void find_winding() {
    is_flipped_.assign(part_.polygons.size(), 0);
    std::vector<uint8_t> is_found(part_.polygons.size(), 0);
    std::vector<uint32_t> front;
    for (uint32_t first = 0; first < is_found.size(); ++first) {
      if (is_found[first]) continue;
      is_found[first] = 1;
      front.assign(1, first);
      while (!front.empty()) {
        const uint32_t polygon = front.back();
        front.pop_back();
        const PolygonCorners& corners = mesh_.face(polygon);
        for (int c = 0; c < corner_count(corners); ++c) {
          const uint32_t a = corners[c], b = corners[(c + 1) % corner_count(corners)];
          const uint32_t other = mesh_.beyond(polygon, a, b);
          if (other == kNoIndex || other == QuadMesh::kNotManifold || is_found[other]) continue;
          is_found[other] = 1;
          const bool runs_alike = mesh_.face(other)[mesh_.edge_corner(other, a, b)] == a;
          is_flipped_[other] = is_flipped_[polygon] ^ runs_alike;
          front.push_back(other);
        }
      }
    }
  }

  // ---- doing it

  void commit(const FaceLoop& loop) {
    filter_loop_materials(loop);
    for (const uint32_t polygon : affected_) {
      if (collapses(polygon)) mesh_.remove(polygon);
    }
    for (uint32_t g = 0; g < groups_.size(); ++g) {
      const auto vertices = vertices_of(groups_[g]);
      const uint32_t into = vertices.front();
      mesh_.merge(vertices);
      for (const uint32_t v : vertices) {
        merged_into[v] = into;
        if (kind_[v] == VertexKind::Border) kind_[into] = VertexKind::Border;
      }
      part_.positions[into] = new_positions_[g];
      deviation[into] = deviations_[g];
    }
    ++collapse_count_;
  }

  /// The mapping of 8.4.4: what lies at the two sides of a quad takes its place, and its share of the materials. Where
  /// a loop crosses itself, and at its ends, a few more faces do.
  void filter_loop_materials(const FaceLoop& loop) {
    std::unordered_map<uint32_t, uint32_t> number;
    for (uint32_t i = 0; i < affected_.size(); ++i) number[affected_[i]] = i;
    DisjointSets sets(affected_.size());
    const auto join_across = [&](uint32_t polygon, uint32_t a, uint32_t b) {
      if (const auto other = number.find(mesh_.beyond(polygon, a, b)); other != number.end()) {
        sets.join(number[polygon], other->second);
      }
    };
    for (size_t i = 0; i < loop.quads.size(); ++i) {
      const Rung &from = loop.rungs[i], &to = loop.rungs[(i + 1) % loop.rungs.size()];
      join_across(loop.quads[i], from.left, to.left);
      join_across(loop.quads[i], from.right, to.right);
    }
    for (const uint32_t end : {loop.before, loop.after}) {
      if (end == kNoIndex) continue;
      const PolygonCorners& t = mesh_.face(end);
      for (int c = 0; c < 3; ++c) {
        const uint32_t a = t[c], b = t[(c + 1) % 3];
        if (mapped(a) != mapped(b)) join_across(end, a, b);
      }
    }
    std::vector<std::pair<uint32_t, uint32_t>> members;  // set, polygon
    for (uint32_t i = 0; i < affected_.size(); ++i) members.emplace_back(sets.least_of(i), affected_[i]);
    std::sort(members.begin(), members.end());
    for (size_t begin = 0, end; begin < members.size(); begin = end) {
      end = begin + 1;
      while (end < members.size() && members[end].first == members[begin].first) ++end;
      if (end - begin > 1) filter_set(std::span(members).subspan(begin, end - begin));
    }
  }

  void filter_set(std::span<const std::pair<uint32_t, uint32_t>> members) {
    std::vector<double> before, now;
    std::vector<uint32_t> triangles;
    std::vector<FaceMaterial> materials;
    for (const auto& [set, polygon] : members) {
      visit_halves(mesh_.face(polygon), [&](int half, const uvec3& t) {
        before.push_back(glm::length(area_vector(corners_at(t))));
        now.push_back(collapses(polygon) ? 0.0 : glm::length(area_vector({after(t.x), after(t.y), after(t.z)})));
        triangles.push_back(part_.triangles[polygon][static_cast<size_t>(half)]);
        materials.push_back(part_.materials[triangles.back()]);
      });
    }
    filter_materials(before, now, materials);
    for (size_t i = 0; i < triangles.size(); ++i) part_.materials[triangles[i]] = materials[i];
  }

  QuadPart part_;
  QuadMesh mesh_;
  const double resolution_;
  const Job& job_;
  std::vector<uint8_t> is_flipped_;  ///< per polygon: wound against its neighbours
  std::vector<VertexKind> kind_;
  std::priority_queue<Candidate> queue_;
  std::vector<Seed> refused_;
  uint32_t collapse_count_ = 0;

  // About the loop at hand; members so that their memory is reused.
  Marks vertex_marks_;  ///< vertices that merge
  Marks ring_marks_;
  Marks polygon_marks_;             ///< affected_
  Marks loop_marks_;                ///< polygons that collapse
  std::vector<uint32_t> group_of_;  ///< of marked vertices
  std::vector<uint32_t> vertices_, crossings_, affected_, star_;
  std::vector<Group> groups_;
  std::vector<KeptTriangle> kept_;  ///< triangles of affected_ that stay
  std::vector<dvec3> new_positions_;
  std::vector<double> deviations_;
  std::vector<LinkEdge> link_;
  CollapseRing ring_;
};

void store_part(const LoopCollapser& collapser, const SurfaceParts& parts, size_t part, WorkingSurface& working,
                std::vector<float>& deviation) {
  const auto vertices = parts.vertices_of(part);
  const auto faces = parts.faces_of(part);
  const QuadPart& result = collapser.part();
  const std::vector<uint32_t>& merged_into = collapser.merged_into;
  for (uint32_t v = 0; v < vertices.size(); ++v) {
    working.merged_into[vertices[v]] = vertices[merged_into[v]];
    working.surface.positions[vertices[v]] = vec3(result.positions[v]);
    deviation[vertices[v]] = static_cast<float>(collapser.deviation[v]);
  }
  for (uint32_t polygon = 0; polygon < result.polygons.size(); ++polygon) {
    for (const uint32_t triangle : result.triangles[polygon]) {
      if (triangle == kNoIndex) continue;
      working.is_face_alive[faces[triangle]] = collapser.is_alive(polygon);
      working.surface.materials[faces[triangle]] = result.materials[triangle];
    }
  }
}

}  // namespace

LoopCollapseResult collapse_loops(const Surface& surface, double resolution, const Job& job) {
  const SurfaceParts parts = find_parts(surface);
  WorkingSurface working = begin_work(surface);
  std::vector<float> deviation(surface.positions.size(), 0.0f);
  if (resolution > 0 && surface.has_quads()) {
    parallel_for(parts.size(), 16, [&](size_t begin, size_t end) {
      for (size_t part = begin; part < end && !job.is_cancelled(); ++part) {
        const auto is_half = [&](uint32_t face) { return surface.quad[face] != kNoIndex; };
        if (std::ranges::none_of(parts.faces_of(part), is_half)) continue;
        LoopCollapser collapser(extract_quad_part(surface, parts, part), resolution, job);
        collapser.run();
        store_part(collapser, parts, part, working, deviation);
      }
    });
  }
  LoopCollapseResult result{finish_work(working, parts), {}};
  result.deviation.assign(result.simplified.surface.positions.size(), 0.0f);
  for (size_t v = 0; v < deviation.size(); ++v) {
    if (working.merged_into[v] == v && result.simplified.vertex_map[v] < result.deviation.size()) {
      result.deviation[result.simplified.vertex_map[v]] = deviation[v];
    }
  }
  return result;
}

}  // namespace farfield
