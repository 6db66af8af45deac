// SPDX-License-Identifier: Apache-2.0
#include "export/material_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "base/hash.h"

namespace farfield {
namespace {

/// Faces of one key are of one group.
using Key = std::array<int16_t, 14>;
struct KeyHash {
  size_t operator()(const Key& key) const { return hash_values(std::span<const int16_t>(key)); }
};

/// Steps of equal width in the square root, as levels store albedos; of light, equal ratios.
class KeyMaker {
 public:
  KeyMaker(const GroupRule& rule, int steps) : rule_(rule), steps_(static_cast<float>(steps)) {}

  Key operator()(const FaceLook& look) const {
    Key key{};
    if (rule_.by_diffuse) set_color(&key[0], look.diffuse);
    set_color(&key[3], look.specular);
    if (rule_.by_transmission) set_color(&key[6], look.transmission);
    for (int c = 0; c < 3; ++c)
      key[static_cast<size_t>(9 + c)] = look.emission[c] > 0 ? rounded(0.1f * steps_ * std::log2(look.emission[c])) : kDark;
    if (look.specular != vec3(0.0f)) key[12] = rounded(steps_ * look.roughness);
    key[13] = rule_.by_opacity ? rounded(steps_ * look.opacity) : look.opacity < 1;
    return key;
  }

 private:
  static constexpr int16_t kDark = -32768;
  static int16_t rounded(float x) { return static_cast<int16_t>(std::lround(std::clamp(x, -32767.0f, 32767.0f))); }
  void set_color(int16_t* key, const vec3& color) const {
    for (int c = 0; c < 3; ++c) key[c] = rounded(steps_ * std::sqrt(color[c]));
  }

  const GroupRule rule_;
  const float steps_;
};

/// Which group each face is in; empty if there would be more groups than the rule allows.
std::vector<uint32_t> groups_of(std::span<const FaceLook> looks, const GroupRule& rule, int steps) {
  const KeyMaker key_of(rule, steps);
  std::unordered_map<Key, uint32_t, KeyHash> numbers;
  std::vector<uint32_t> groups;
  groups.reserve(looks.size());
  for (const FaceLook& look : looks) {
    groups.push_back(numbers.try_emplace(key_of(look), static_cast<uint32_t>(numbers.size())).first->second);
    if (numbers.size() > rule.most_groups && steps > 1) return {};
  }
  return groups;
}

/// Sums of what faces of a group are; double, for there may be millions.
struct Sums {
  double area = 0, seen = 0, opacity = 0, roughness2 = 0;
  dvec3 diffuse{0.0}, specular{0.0}, transmission{0.0}, emission{0.0};

  void add(const FaceLook& look) {
    constexpr double kLeast = 1e-30;  // so that faces without area or opacity have a mean
    const double a = std::max(look.area, kLeast), s = std::max(a * double{look.opacity}, kLeast * a);
    area += a, seen += s;
    opacity += a * double{look.opacity};
    roughness2 += s * std::pow(double{look.roughness}, 4.0);
    diffuse += s * dvec3(look.diffuse);
    specular += s * dvec3(look.specular);
    transmission += s * dvec3(look.transmission);
    emission += s * dvec3(look.emission);
  }
  FaceLook mean() const {
    return {vec3(diffuse / seen),
            vec3(specular / seen),
            vec3(transmission / seen),
            vec3(emission / seen),
            static_cast<float>(std::pow(roughness2 / seen, 0.25)),
            static_cast<float>(opacity / area),
            area};
  }
};

}  // namespace

MaterialGroups group_materials(std::span<const FaceLook> looks, const GroupRule& rule) {
  constexpr int kFinest = 255;  // as levels store them
  MaterialGroups out;
  for (int steps = kFinest; out.of_face.empty() && !looks.empty(); steps /= 2) {
    out.of_face = groups_of(looks, rule, steps);
    out.widest_step = steps == kFinest ? 0.0f : 1.0f / static_cast<float>(steps);
  }
  std::vector<Sums> sums;
  std::vector<uint32_t> counts;
  for (size_t f = 0; f < looks.size(); ++f) {
    const uint32_t group = out.of_face[f];
    if (group == sums.size()) sums.emplace_back(), counts.push_back(0);
    sums[group].add(looks[f]);
    ++counts[group];
  }
  for (const Sums& of_group : sums) out.looks.push_back(of_group.mean());
  for (const uint32_t count : counts) out.begin.push_back(out.begin.back() + count);
  out.faces.resize(looks.size());
  std::vector<uint32_t> next(out.begin.begin(), out.begin.end() - 1);
  for (uint32_t f = 0; f < looks.size(); ++f) out.faces[next[out.of_face[f]]++] = f;
  return out;
}

}  // namespace farfield
