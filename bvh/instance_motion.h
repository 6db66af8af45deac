// SPDX-License-Identifier: Apache-2.0
// Instances that move while the shutter is open.
#pragma once

#include <span>
#include <vector>

#include "base/result.h"
#include "base/vec.h"
#include "bvh/instance_record.h"

namespace farfield {

/// The transforms of an instance at ray times that are evenly spaced from 0 to 1; in between, each entry goes linearly
/// from one to the next, as those of Embree's own instances do. Points of the instance move along straight lines then,
/// so bounds that are interpolated between keys contain them. Immutable.
class InstanceMotion {
 public:
  /// As many as Embree has time steps.
  static constexpr size_t kMostKeys = 129;

  /// keys: local to world; at least two. Errors: InvalidArgument (their number; a transform that make_instance refuses;
  /// one in between that squeezes the instance flat).
  static Result<InstanceMotion> make(std::span<const mat4x3> keys);

  size_t key_count() const { return keys_.size(); }
  /// What it takes, its place in a table of motions included.
  uint64_t bytes() const { return keys_.size() * sizeof(mat4x3) + 128; }
  /// What `record` is at a ray time; times outside of [0, 1] are its ends.
  InstanceRecord at(const InstanceRecord& record, float time) const;

 private:
  explicit InstanceMotion(std::span<const mat4x3> keys) : keys_(keys.begin(), keys.end()) {}
  std::vector<mat4x3> keys_;
};

}  // namespace farfield
