// SPDX-License-Identifier: Apache-2.0
#include "prefilter/material_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace farfield {
namespace {

FaceMaterial random_material(std::mt19937& rng) {
  std::uniform_real_distribution<float> u;
  const auto color = [&] { return vec3(u(rng), u(rng), u(rng)); };
  const auto matrix = [&] { return SymMat3{u(rng), u(rng), u(rng), u(rng), u(rng), u(rng)}; };
  return {matrix(), color(), color(), color(), u(rng), matrix(), u(rng), color(), u(rng), {u(rng), u(rng), u(rng)}};
}

FaceMaterial mean_material(const std::vector<double>& area, const std::vector<FaceMaterial>& materials) {
  double total = 0;
  for (const double a : area) total += a;
  FaceMaterial mean = mix(materials[0], 0.0f, materials[0], 0.0f);
  for (size_t i = 0; i < area.size(); ++i) mean = mix(mean, 1.0f, materials[i], static_cast<float>(area[i] / total));
  return mean;
}

void expect_near(const FaceMaterial& a, const FaceMaterial& b, float tolerance) {
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(a.diffuse[c], b.diffuse[c], tolerance);
    EXPECT_NEAR(a.specular[c], b.specular[c], tolerance);
    EXPECT_NEAR(a.transmission[c], b.transmission[c], tolerance);
  }
  EXPECT_NEAR(a.roughness2, b.roughness2, tolerance);
  EXPECT_NEAR(a.gap, b.gap, tolerance);
  EXPECT_NEAR(a.sheet.edge, b.sheet.edge, tolerance);
  EXPECT_NEAR(a.sheet.order, b.sheet.order, tolerance);
  EXPECT_NEAR(a.sheet.caught, b.sheet.caught, tolerance);
  EXPECT_NEAR(a.sggx.xx, b.sggx.xx, tolerance);
  EXPECT_NEAR(a.sggx.yy, b.sggx.yy, tolerance);
  EXPECT_NEAR(a.sggx.zz, b.sggx.zz, tolerance);
  EXPECT_NEAR(a.sggx.xy, b.sggx.xy, tolerance);
  EXPECT_NEAR(a.sggx.xz, b.sggx.xz, tolerance);
  EXPECT_NEAR(a.sggx.yz, b.sggx.yz, tolerance);
}

TEST(MaterialFilter, TheMeanOverTheAreaIsTheSameAfterAnyCollapse) {  // eq. 8.3.7
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> u;
  for (int round = 0; round < 500; ++round) {
    const size_t faces = 3 + rng() % 12, collapsing = 1 + rng() % 2;
    std::vector<double> before(faces), after(faces, 0.0);
    for (double& a : before) a = rng() % 8 == 0 ? 0.0 : u(rng);
    for (size_t i = 0; i + collapsing < faces; ++i) after[i] = rng() % 8 == 0 ? 0.0 : u(rng);
    before[0] += 0.1, after[0] += 0.1;
    std::vector<FaceMaterial> materials(faces);
    for (FaceMaterial& material : materials) material = random_material(rng);
    const FaceMaterial mean = mean_material(before, materials);
    filter_materials(before, after, materials);
    expect_near(mean_material(after, materials), mean, 2e-6f);
  }
}

TEST(MaterialFilter, AFaceWhoseShareDoesNotGrowKeepsItsOwn) {
  std::mt19937 rng(8);
  std::vector<FaceMaterial> materials(4);
  for (FaceMaterial& material : materials) material = random_material(rng);
  const std::vector<FaceMaterial> input = materials;
  filter_materials(std::vector{1.0, 1.0, 1.0, 1.0}, std::vector{1.0, 0.5, 2.5, 0.0}, materials);
  EXPECT_EQ(materials[0].diffuse, input[0].diffuse);
  EXPECT_EQ(materials[1].diffuse, input[1].diffuse);
  EXPECT_NE(materials[2].diffuse, input[2].diffuse);
  // Face 2 takes what faces 1 and 3 lose: a half and a whole part next to its own.
  const vec3 expected = (input[2].diffuse + 0.5f * input[1].diffuse + input[3].diffuse) / 2.5f;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(materials[2].diffuse[c], expected[c], 1e-6f);
}

TEST(MaterialFilter, WithoutAreaEveryFaceKeepsItsOwn) {
  std::mt19937 rng(9);
  std::vector<FaceMaterial> materials(3);
  for (FaceMaterial& material : materials) material = random_material(rng);
  const std::vector<FaceMaterial> input = materials;
  const std::vector<double> some = {1.0, 2.0, 0.0}, none = {0.0, 0.0, 0.0};
  filter_materials(none, some, materials);
  filter_materials(some, none, materials);
  filter_materials(some, some, materials);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(materials[i].diffuse, input[i].diffuse);
}

}  // namespace
}  // namespace farfield
