// SPDX-License-Identifier: Apache-2.0
#include "export/material_groups.h"

#include <gtest/gtest.h>

#include <set>

#include "base/random.h"

namespace farfield {
namespace {

std::vector<FaceLook> random_looks(size_t count, uint64_t seed) {
  Rng rng(seed);
  std::vector<FaceLook> looks(count);
  for (FaceLook& look : looks) {
    look.diffuse = {rng.next(), rng.next(), rng.next()};
    look.specular = vec3(0.05f * rng.next());
    look.transmission = vec3(0.2f * rng.next());
    if (rng.next() < 0.1f) look.emission = vec3(1000 * rng.next());
    look.roughness = rng.next();
    look.opacity = rng.next() < 0.5f ? 1.0f : rng.next();
    look.area = double{rng.next()};
  }
  return looks;
}

dvec3 light_of(std::span<const FaceLook> looks, const vec3 FaceLook::*color) {
  dvec3 sum(0.0);
  for (const FaceLook& look : looks) sum += look.area * double{look.opacity} * dvec3(look.*color);
  return sum;
}

TEST(MaterialGroups, OfFewLooksAreTheseLooks) {
  std::vector<FaceLook> looks = random_looks(5, 1);
  const std::vector<FaceLook> once = looks;
  for (int i = 0; i < 20; ++i) looks.push_back(once[static_cast<size_t>(i * i % 5)]);
  const MaterialGroups groups = group_materials(looks, {});
  ASSERT_EQ(groups.looks.size(), 5u);
  EXPECT_EQ(groups.widest_step, 0.0f);
  for (size_t f = 0; f < looks.size(); ++f) {
    const FaceLook& group = groups.looks[groups.of_face[f]];
    EXPECT_LT(max_component(glm::abs(group.diffuse - looks[f].diffuse)), 1e-6f);
    EXPECT_NEAR(group.opacity, looks[f].opacity, 1e-6f);
    EXPECT_NEAR(group.roughness, looks[f].roughness, 1e-6f);
  }
}

TEST(MaterialGroups, KeepLightAndNumberAndHaveEachFaceOnce) {
  const std::vector<FaceLook> looks = random_looks(20000, 2);
  for (const uint32_t most : {1u, 10u, 1000u}) {
    const MaterialGroups groups = group_materials(looks, {.most_groups = most});
    // With one step per channel there are still a few: channels of 0 and of 1.
    if (most > 1) {
      EXPECT_LE(groups.looks.size(), std::max(most, 1024u));
    }
    EXPECT_GT(groups.widest_step, 0.0f);
    EXPECT_EQ(std::set<uint32_t>(groups.faces.begin(), groups.faces.end()).size(), looks.size());
    EXPECT_EQ(groups.begin.back(), looks.size());
    for (size_t g = 0; g + 1 < groups.begin.size(); ++g) {
      for (uint32_t i = groups.begin[g]; i < groups.begin[g + 1]; ++i) EXPECT_EQ(groups.of_face[groups.faces[i]], g);
    }
    for (const auto color : {&FaceLook::diffuse, &FaceLook::specular, &FaceLook::transmission, &FaceLook::emission}) {
      const dvec3 before = light_of(looks, color), after = light_of(groups.looks, color);
      EXPECT_LT(glm::length(after - before), 1e-5 * glm::length(before)) << most;
    }
  }
}

TEST(MaterialGroups, FollowTheRule) {
  std::vector<FaceLook> looks(4);
  looks[1].diffuse = vec3(0.5f);
  looks[2].opacity = 0.5f;
  looks[3].opacity = 0.25f;
  for (FaceLook& look : looks) look.area = 1;
  EXPECT_EQ(group_materials(looks, {}).looks.size(), 4u);
  EXPECT_EQ(group_materials(looks, {.by_diffuse = false}).looks.size(), 3u);
  EXPECT_EQ(group_materials(looks, {.by_diffuse = false, .by_opacity = false}).looks.size(), 2u);
}

TEST(MaterialGroups, OfNothingAndOfFacesWithoutAreaAreDefined) {
  EXPECT_TRUE(group_materials({}, {}).looks.empty());
  std::vector<FaceLook> looks(2);
  looks[0].diffuse = vec3(0.25f);
  looks[1].diffuse = vec3(0.25f);
  looks[1].opacity = 0;
  const MaterialGroups groups = group_materials(looks, {});
  ASSERT_EQ(groups.looks.size(), 2u);
  for (const FaceLook& look : groups.looks) EXPECT_NEAR(look.diffuse.x, 0.25f, 1e-6f);
}

}  // namespace
}  // namespace farfield
