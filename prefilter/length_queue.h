// SPDX-License-Identifier: Apache-2.0
// Edges, shortest first, in parts of similar length: only the part at hand is sorted, small enough for the caches where
// one heap of all edges misses them at each of its steps. What comes to that part later, little, is a heap beside it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
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
    if (part >= next_) {
      parts_[part].push_back(edge);
    } else {
      late_.push_back(edge);
      std::push_heap(late_.begin(), late_.end());
    }
  }

  /// Takes the top away; false if there is none.
  bool pop(Edge& edge) {
    while (sorted_.empty() && late_.empty()) {
      if (next_ == parts_.size()) return false;
      sorted_ = std::exchange(parts_[next_++], {});
      std::sort(sorted_.begin(), sorted_.end());
    }
    if (late_.empty() || (!sorted_.empty() && late_.front() < sorted_.back())) {
      edge = sorted_.back();
      sorted_.pop_back();
    } else {
      edge = late_.front();
      std::pop_heap(late_.begin(), late_.end());
      late_.pop_back();
    }
    return true;
  }

 private:
  static constexpr size_t kEdgesPerPart = 512, kMostParts = 1 << 14;

  std::vector<std::vector<Edge>> parts_;  ///< by length
  double parts_per_length2_;
  size_t next_ = 0;           ///< those before it are empty and stay so
  std::vector<Edge> sorted_;  ///< the part at hand, the top last
  std::vector<Edge> late_;    ///< what came to it, or before it, since: a heap
};

}  // namespace farfield
