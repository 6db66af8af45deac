// SPDX-License-Identifier: Apache-2.0
#include "prefilter/self_shadowing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prefilter/measure_volume.h"
#include "scattering/highlight.h"
#include "scattering/highlight_lean.h"
#include "scattering/hot_spot.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

using test::leaf_cloud;
using test::LeafCloud;

Voxel grey() {
  Voxel voxel;
  voxel.density = 1;
  voxel.diffuse = vec3(1.0f, 0.3f, 0.0f);
  return voxel;
}

TEST(LetEscape, DoesNothingForARatioOfOne) {
  Voxel voxel = grey();
  let_escape(1, voxel);
  EXPECT_EQ(voxel.self_shadowing, 1);
  EXPECT_NEAR(voxel.diffuse.y, 0.3f, 1e-6f);
}

TEST(LetEscape, ShadowsBelowOneAndBrightensAbove) {
  Voxel clumped = grey(), smooth = grey();
  let_escape(0.4, clumped);
  EXPECT_NEAR(clumped.self_shadowing, 0.4f, 1e-6f);
  EXPECT_EQ(clumped.diffuse.y, 0.3f);
  let_escape(1.5, smooth);
  EXPECT_EQ(smooth.self_shadowing, 1);
  EXPECT_NEAR(smooth.diffuse.x, 1, 1e-6f);
  const double kept = std::pow(0.3, 1.5);
  EXPECT_NEAR(smooth.diffuse.y, 1.5 * 0.3 / (1 - kept + 1.5 * kept), 1e-6);
  EXPECT_EQ(smooth.diffuse.z, 0);
}

TEST(LetEscape, StaysWithinItsBounds) {
  Voxel none = grey(), all = grey();
  let_escape(0, none);
  EXPECT_NEAR(none.self_shadowing, kLeastEscape, 1e-6);
  let_escape(1e30, all);
  EXPECT_NEAR(all.diffuse.y, 2 * 0.3 / 1.3, 1e-6);
}

TEST(LetEscape, MultipliesTheOddsWhereHalfOrMoreGoesThrough) {
  for (const float through : {0.5f, 0.75f, 1.0f}) {
    Voxel leaf = grey();
    leaf.diffuse = vec3(0.3f * (1 - through)), leaf.transmission = vec3(0.3f * through);
    let_escape(1.5, leaf);
    EXPECT_NEAR(leaf.diffuse.x + leaf.transmission.x, 1.5 * 0.3 / (0.7 + 1.5 * 0.3), 1e-6) << through;
    EXPECT_NEAR(leaf.transmission.x, through * (leaf.diffuse.x + leaf.transmission.x), 1e-6) << through;
  }
}

TEST(LetEscape, GainsLessTheMoreGoesThroughAndNeverMakesMoreThanWhite) {
  for (const float albedo : {1e-6f, 0.3f, 0.9f, 1.0f}) {
    float last = 1 + 1e-6f;
    for (const float through : {0.0f, 0.1f, 0.3f, 0.5f}) {
      Voxel leaf = grey();
      leaf.diffuse = vec3(albedo * (1 - through)), leaf.transmission = vec3(albedo * through);
      let_escape(1.2, leaf);
      const float all = leaf.diffuse.x + leaf.transmission.x;
      EXPECT_LE(all, last * (1 + 1e-5f)) << albedo << " " << through;
      EXPECT_GE(all, albedo * (1 - 1e-5f)) << albedo << " " << through;
      last = all;
    }
  }
}

TEST(LetThrough, MovesLightFromOneSideToTheOtherAndKeepsItsSum) {
  Voxel voxel = grey();
  voxel.diffuse = {0.2f, 0.5f, 0.0f}, voxel.transmission = {0.2f, 0.5f, 0.0f};
  let_through(0.5, voxel);
  EXPECT_NEAR(voxel.transmission.x, 0.4 / 3, 1e-6);
  EXPECT_NEAR(voxel.transmission.y, 1.0 / 3, 1e-6);
  EXPECT_NEAR(voxel.diffuse.x + voxel.transmission.x, 0.4, 1e-6);
  EXPECT_NEAR(voxel.diffuse.y + voxel.transmission.y, 1, 1e-6);
  EXPECT_EQ(voxel.diffuse.z + voxel.transmission.z, 0);
  Voxel opaque = grey();
  let_through(1e30, opaque);
  EXPECT_EQ(opaque.diffuse, grey().diffuse);
  EXPECT_EQ(opaque.transmission, vec3(0.0f));
}

TEST(LetGlance, ChangesTheMeanHighlightByTheRatioAndLeavesWhiteMirrors) {
  const auto mean = [](const Voxel& v) { return Highlight(v.specular, v.roughness2).mean_albedo().y; };
  for (const double ratio : {0.5, 0.9, 1.0, 1.5}) {
    Voxel voxel = grey();
    voxel.specular = vec3(0.04f), voxel.roughness2 = 0.1f;
    const float before = mean(voxel);
    let_glance(ratio, voxel);
    EXPECT_NEAR(mean(voxel), before * ratio / (1 - before + ratio * before), 1e-3) << ratio;
    voxel.specular = vec3(1.0f, 0.0f, 1.0f);
    let_glance(ratio, voxel);
    EXPECT_NEAR(voxel.specular.x, 1, 1e-3) << ratio;
    EXPECT_EQ(voxel.specular.y, 0) << ratio;
  }
  Voxel dull = grey();
  dull.specular = vec3(0.0f);
  let_glance(2, dull);
  EXPECT_EQ(dull.specular, vec3(0.0f));
}

TEST(Recolor, MultipliesOddsByChannelAndLeavesWhite) {
  Voxel voxel;
  voxel.diffuse = vec3(0.2f, 0.5f, 0.0f), voxel.transmission = vec3(0.1f, 0.5f, 0.0f);
  recolor({1.1f, 0.8f, 2.0f}, voxel);
  EXPECT_NEAR(voxel.diffuse.x + voxel.transmission.x, 0.3f * 1.1f / (0.7f + 0.33f), 1e-6f);
  EXPECT_NEAR(voxel.diffuse.x, 2 * voxel.transmission.x, 1e-6f);
  EXPECT_NEAR(voxel.diffuse.y + voxel.transmission.y, 1, 1e-6f);
  EXPECT_EQ(voxel.diffuse.z, 0);
}

SparseVolume voxelized(const Surface& geometry, double voxel_size) {
  return *measure_volume(geometry, {}, {dvec3(0), voxel_size}, {.rays_per_voxel = 100});
}

struct Means {
  double self_shadowing = 0, diffuse = 0;
};
Means means_of(const SparseVolume& volume) {
  Means mean;
  double weight = 0;
  for (const Voxel& v : volume.voxels) {
    mean.self_shadowing += v.density * v.self_shadowing;
    mean.diffuse += v.density * v.diffuse.y;
    weight += v.density;
  }
  return {mean.self_shadowing / weight, mean.diffuse / weight};
}

// Leaves anywhere, with any normal, are what a medium is: they need neither self-shadowing nor a gain. Single voxels
// are noisy to both sides (about 40 leaves each).
TEST(SelfShadowing, OfLeavesAtRandomIsOnlyNoise) {
  LeafCloud cloud;
  cloud.count = 20000, cloud.leaf_size = 0.012f;
  const Means mean = means_of(voxelized(leaf_cloud(cloud), 1.0 / 8));
  EXPECT_NEAR(mean.self_shadowing, 1, 0.03);
  EXPECT_NEAR(mean.diffuse, 0.5, 0.02);
}

// Where the viewer's way to a leaf is free, so is that of light from there; it counts the more, the more is in the way.
TEST(HotSpot, OfLeavesIsSeenAndGrowsWithTheirNumber) {
  LeafCloud cloud;
  cloud.leaf_size = 0.06f;
  const auto strength = [&](int count) {
    cloud.count = count;
    return voxelized(leaf_cloud(cloud), 1.0 / 8).hot_spot;
  };
  const float few = strength(100), many = strength(2000);
  EXPECT_GE(few, 0.0f);
  EXPECT_GT(many, few + 0.02f);
  EXPECT_LT(many, kStrongestHotSpot);
}

// Roofs of two leaves each, open below: what is seen from above loses less light than what is seen from below.
TEST(OpenSide, OfFoldedLeavesIsTheSideThatBulges) {
  const auto of_roofs = [](float drop) {
    LeafCloud cloud;
    cloud.count = 3000, cloud.leaf_size = 0.02f;
    const Surface leaves = leaf_cloud(cloud);
    Surface roofs;
    for (size_t i = 0; i < leaves.positions.size(); i += 4) {
      const vec3 p = leaves.positions[i];
      const auto v = static_cast<uint32_t>(roofs.positions.size());
      for (const float x : {-0.015f, 0.0f, 0.015f}) {
        for (const float y : {-0.03f, 0.03f}) roofs.positions.push_back(p + vec3(x, y, x == 0 ? 0.0f : -drop));
      }
      for (const uvec3& t : {uvec3(0, 2, 3), uvec3(0, 3, 1), uvec3(2, 4, 5), uvec3(2, 5, 3)}) {
        roofs.triangles.push_back(t + v);
        FaceMaterial material;
        material.diffuse = vec3(0.1f);
        const vec3 a = roofs.positions[v + t.x], b = roofs.positions[v + t.y], c = roofs.positions[v + t.z];
        material.sggx = SymMat3::outer(glm::normalize(glm::cross(b - a, c - a)));
        roofs.materials.push_back(material);
      }
    }
    return voxelized(roofs, 1.0 / 4).open_side;
  };
  const vec3 steep = of_roofs(0.02f), flat = of_roofs(0);
  EXPECT_GT(steep.z, 0.1f);
  EXPECT_LT(std::abs(steep.x) + std::abs(steep.y), 0.05f);
  EXPECT_LT(glm::length(flat), 0.05f);
}

double share_through(const Surface& leaves) {
  double through = 0, all = 0;
  for (const Voxel& v : voxelized(leaves, 1.0 / 4).voxels) {
    through += v.density * v.transmission.x;
    all += v.density * (v.transmission.x + v.diffuse.x);
  }
  return through / all;
}

/// Every leaf twice, one above the other.
Surface in_pairs(const Surface& leaves, float gap) {
  Surface pairs = leaves;
  const auto first = static_cast<uint32_t>(leaves.positions.size());
  for (const vec3& p : leaves.positions) pairs.positions.push_back(p + vec3(0, 0, gap));
  for (size_t t = 0; t < leaves.triangles.size(); ++t) {
    pairs.triangles.push_back(leaves.triangles[t] + first);
    pairs.materials.push_back(leaves.materials[t]);
  }
  return pairs;
}

// Of two leaves on top of each other what goes through one meets the other; what one reflects is free.
TEST(Through, OfLeavesInPairsIsLess) {
  LeafCloud cloud;
  cloud.count = 1500, cloud.leaf_size = 0.03f;
  Surface single = leaf_cloud(cloud);
  for (FaceMaterial& m : single.materials) m.diffuse = vec3(0.2f), m.transmission = vec3(0.2f);
  EXPECT_NEAR(share_through(single), 0.5, 0.02);
  EXPECT_LT(share_through(in_pairs(single, 0.004f)), 0.4);
}

/// Leaves in tufts, each much smaller than a voxel.
Surface tufts() {
  LeafCloud cloud;
  cloud.count = 20000, cloud.leaf_size = 0.012f;
  Surface leaves = leaf_cloud(cloud);
  for (size_t i = 0; i < leaves.positions.size(); i += 4) {  // four corners of a leaf
    const vec3 middle =
        0.25f * (leaves.positions[i] + leaves.positions[i + 1] + leaves.positions[i + 2] + leaves.positions[i + 3]);
    const vec3 tuft = (glm::floor(8.0f * middle) + 0.5f) / 8.0f;
    for (size_t k = i; k < i + 4; ++k) leaves.positions[k] += 0.8f * (tuft - middle);
  }
  return leaves;
}

// Most of the light meets another leaf of the same tuft.
TEST(SelfShadowing, OfTuftsIsStrong) { EXPECT_LT(means_of(voxelized(tufts(), 1.0 / 4)).self_shadowing, 0.8); }

// What glances off a tuft on the viewer's side is free; what glances off its leaves away from the viewer is not.
TEST(HighlightLean, OfTuftsIsTowardsTheViewer) {
  LeafCloud cloud;
  cloud.count = 4000, cloud.leaf_size = 0.012f;
  const auto lean = [](Surface leaves) {
    for (FaceMaterial& m : leaves.materials) m.diffuse = vec3(0.05f), m.specular = vec3(0.04f), m.roughness2 = 0.1f;
    return voxelized(leaves, 1.0 / 4).highlight_lean;
  };
  const float alone = lean(leaf_cloud(cloud)), of_tufts = lean(tufts());
  EXPECT_NEAR(alone, 0, 0.1);
  EXPECT_GT(of_tufts, alone + 0.1f);
  EXPECT_LE(of_tufts, kMostHighlightLean);
}

// At 1e-18 squares of the normals are no floats any more; what Embree still hits there must give sound voxels.
TEST(SelfShadowing, IsTheSameOnAnyScaleAndFiniteBeyond) {
  LeafCloud cloud;
  const Surface leaves = leaf_cloud(cloud);
  const double expected = means_of(voxelized(leaves, 1.0 / 8)).self_shadowing;
  for (const float scale : {1e-8f, 1e8f}) {
    Surface scaled = leaves;
    for (vec3& p : scaled.positions) p *= scale;
    EXPECT_NEAR(means_of(voxelized(scaled, double(scale) / 8)).self_shadowing, expected, 1e-3) << scale;
  }
  Surface tiny = leaves;
  for (vec3& p : tiny.positions) p *= 1e-18f;
  for (const Voxel& v : voxelized(tiny, 1e-18 / 8).voxels) {
    EXPECT_TRUE(v.self_shadowing > 0 && v.self_shadowing <= 1) << v.self_shadowing;
    EXPECT_TRUE(v.diffuse.y >= 0 && v.diffuse.y <= 1) << v.diffuse.y;
  }
}

// Nothing shadows a plane, while a medium in its place shadows itself.
TEST(SelfShadowing, OfAPlaneIsAGainThatLeavesWhiteAlone) {
  Surface plane;
  plane.positions = {{0, 0, 0.5f}, {1, 0, 0.5f}, {1, 1, 0.5f}, {0, 1, 0.5f}};
  plane.triangles = {{0, 1, 2}, {0, 2, 3}};
  FaceMaterial material;
  material.sggx = SymMat3::outer({0, 0, 1});
  material.diffuse = vec3(1.0f, 0.3f, 0.0f);
  plane.materials.assign(2, material);
  for (const Voxel& v : voxelized(plane, 1.0 / 7).voxels) {
    EXPECT_EQ(v.self_shadowing, 1);
    EXPECT_NEAR(v.diffuse.x, 1, 1e-5);
    // Of flat flakes all alike a half-space would reflect 0.3 with 2 * 0.3 / (1 + 0.3^2) = 0.55, a layer with less.
    EXPECT_GT(v.diffuse.y, 0.46f);
    EXPECT_LT(v.diffuse.y, 0.55f);
    EXPECT_EQ(v.diffuse.z, 0);
  }
}

}  // namespace
}  // namespace farfield
