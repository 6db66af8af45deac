// SPDX-License-Identifier: Apache-2.0
// Edges, shortest first, in parts of similar length: only the part at hand is a heap, small enough for the caches where
// one heap of all edges misses them at each of its steps.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace farfield {

/// Gives edges in the order of a std::priority_queue: the top is the greatest by operator<, for which a longer edge
/// must be less. `Edge` has a squared length `length2` in [0, longest2]. One thread at a time.
template <typename Edge>
class LengthQueue {
 public:
  /// edge_count: about as many as there will be at first.
  LengthQueue(double longest2, size_t edge_count)
      : parts_(std::clamp<size_t>(edge_count / kEdgesPerPart, 1, kMostParts)),
        parts_per_length2_(longest2 > 0 ? static_cast<double>(parts_.size()) / longest2 : 0.0) {}

  void push(const Edge& edge) {
    const auto part = std::min(static_cast<size_t>(edge.length2 * parts_per_length2_), parts_.size() - 1);
    std::vector<Edge>& edges = parts_[std::max(part, first_)];
    edges.push_back(edge);
    if (part <= first_) std::push_heap(edges.begin(), edges.end());
  }

  /// Takes the top away; false if there is none.
  bool pop(Edge& edge) {
    while (parts_[first_].empty()) {
      if (first_ + 1 == parts_.size()) return false;
      parts_[first_] = {};
      ++first_;
      std::make_heap(parts_[first_].begin(), parts_[first_].end());
    }
    std::vector<Edge>& edges = parts_[first_];
    std::pop_heap(edges.begin(), edges.end());
    edge = edges.back();
    edges.pop_back();
    return true;
  }

 private:
  static constexpr size_t kEdgesPerPart = 128, kMostParts = 1 << 14;

  std::vector<std::vector<Edge>> parts_;  ///< by length; the first is a heap
  double parts_per_length2_;
  size_t first_ = 0;  ///< those before it are empty and stay so
};

}  // namespace farfield
