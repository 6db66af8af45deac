// SPDX-License-Identifier: Apache-2.0
#include "prefilter/resolve.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <map>

#include "base/index.h"
#include "prefilter/face_materials.h"
#include "tests/support/images.h"
#include "tests/support/source_surfaces.h"

namespace farfield {
namespace {

using test::image;

/// The unit square as two triangles, texture coordinates (x, y).
SourceSurface square() {
  SourceSurface s;
  s.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const uvec3& t : s.triangles) {
    for (int k = 0; k < 3; ++k) s.corner_uv.emplace_back(s.positions[t[k]]);
  }
  s.material = {0, 0};
  s.source_face = {0, 0};
  s.materials.resize(1);
  s.materials[0].base_color = vec3(1.0f);
  return s;
}

double area_of(const Surface& s, size_t f) {
  const uvec3& t = s.triangles[f];
  return 0.5 * glm::length(
                   glm::cross(dvec3(s.positions[t.y] - s.positions[t.x]), dvec3(s.positions[t.z] - s.positions[t.x])));
}

double total_area(const Surface& s) {
  double sum = 0;
  for (size_t f = 0; f < s.triangles.size(); ++f) sum += area_of(s, f);
  return sum;
}

/// Length of edges that only one face has: the outline, if nothing is torn.
double border_length(const Surface& s) {
  std::map<std::pair<uint32_t, uint32_t>, int> faces;
  for (const uvec3& t : s.triangles) {
    for (int k = 0; k < 3; ++k) ++faces[std::minmax(t[k], t[(k + 1) % 3])];
  }
  double length = 0;
  for (const auto& [edge, count] : faces) {
    EXPECT_LE(count, 2);
    if (count == 1) length += glm::distance(s.positions[edge.first], s.positions[edge.second]);
  }
  return length;
}

/// The smallest angle of all faces, in degrees.
double smallest_angle(const Surface& s) {
  double smallest = 180;
  for (const uvec3& t : s.triangles) {
    for (int k = 0; k < 3; ++k) {
      const vec3 a = s.positions[t[(k + 1) % 3]] - s.positions[t[k]],
                 b = s.positions[t[(k + 2) % 3]] - s.positions[t[k]];
      smallest = std::min(smallest, std::acos(double(glm::dot(glm::normalize(a), glm::normalize(b)))) * 180 / M_PI);
    }
  }
  return smallest;
}

TEST(Resolve, LeavesPlainFacesWhole) {
  const auto resolved = resolve(square(), 0.01f);
  ASSERT_TRUE(resolved);
  EXPECT_EQ(resolved->surface.triangles.size(), 2u);
  EXPECT_EQ(resolved->vertex_of, (std::vector<uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(resolved->face_of, (std::vector<uint32_t>{0, 1}));
}

TEST(Resolve, SplitsWhereATextureVariesAndOnlyThere) {
  SourceSurface source = square();
  source.materials[0].base_color_map.image =
      image(256, [](int x, int y) { return vec4(vec3(x < 64 && y < 64 && (x / 8 + y / 8) % 2 ? 0.9f : 0.1f), 1); });
  const auto resolved = resolve(source, 1.0f / 32);
  ASSERT_TRUE(resolved);
  const Surface& s = resolved->surface;
  EXPECT_GT(s.triangles.size(), 500u);
  EXPECT_LT(s.triangles.size(), estimate_resolved_faces(square(), 1.0f / 32) + 5u * 32 * 32 / 8);
  EXPECT_NEAR(total_area(s), 1, 1e-5);
  EXPECT_NEAR(border_length(s), 4, 1e-5);  // no crack, no T-junction
  EXPECT_GE(smallest_angle(s), 44.9);      // bisected right triangles stay right
  double mean = 0;
  for (size_t f = 0; f < s.triangles.size(); ++f) {
    mean += area_of(s, f) * s.materials[f].diffuse.x;
    const vec3 middle =
        (s.positions[s.triangles[f].x] + s.positions[s.triangles[f].y] + s.positions[s.triangles[f].z]) / 3.0f;
    if (middle.x < 0.2f && middle.y < 0.2f) {
      EXPECT_LT(area_of(s, f), 1.01 / 32 / 32);
    }
  }
  EXPECT_NEAR(mean, 0.1 + 0.8 / 16 / 2, 2e-3);
}

TEST(Resolve, QuadsAreKnownWhereTheyStayWhole) {
  SourceSurface source = square();
  EXPECT_FALSE(resolve(source, 0.01f)->surface.has_quads());
  source.quad = {7, 7};
  EXPECT_EQ(resolve(source, 0.01f)->surface.quad, (std::vector<uint32_t>{7, 7}));
  source.materials[0].base_color_map.image =
      image(256, [](int x, int y) { return vec4(vec3((x / 8 + y / 8) % 2 ? 0.9f : 0.1f), 1); });
  const auto split = resolve(source, 1.0f / 32);
  EXPECT_EQ(split->surface.quad, std::vector<uint32_t>(split->surface.triangles.size(), kNoIndex));
}

TEST(Resolve, DetailBelowTheResolutionDoesNotSplit) {
  SourceSurface source = square();
  source.materials[0].base_color_map.image = image(256, [](int x, int y) { return vec4(vec3(float((x + y) % 2)), 1); });
  const auto resolved = resolve(source, 1.0f / 8);
  ASSERT_TRUE(resolved);
  EXPECT_EQ(resolved->surface.triangles.size(), 2u);
  EXPECT_NEAR(resolved->surface.materials[0].diffuse.x, 0.5f, 0.01f);
}

TEST(Resolve, SharesSplitsWithNeighboursOfOtherMaterials) {
  SourceSurface source = square();
  source.materials.resize(2);
  source.material = {0, 1};
  source.materials[0].base_color_map.image =
      image(64, [](int x, int) { return vec4(vec3(x / 8 % 2 ? 1.0f : 0.0f), 1); });
  const auto resolved = resolve(source, 1.0f / 16);
  ASSERT_TRUE(resolved);
  EXPECT_NEAR(border_length(resolved->surface), 4, 1e-5);
  EXPECT_NEAR(total_area(resolved->surface), 1, 1e-5);
}

TEST(Resolve, CutsMasksAndKeepsTheShareOfBlends) {
  SourceSurface source = square();
  source.materials[0].alpha_mode = AlphaMode::Mask;
  source.materials[0].base_color_map.image = image(64, [](int x, int) { return vec4(1, 1, 1, x < 16 ? 1 : 0); });
  source.materials[0].base_color_map.wrap_u = Wrap::Clamp;
  const auto masked = resolve(source, 10);
  ASSERT_TRUE(masked);
  EXPECT_NEAR(total_area(masked->surface), 0.25, 0.005);
  for (const FaceMaterial& m : masked->surface.materials) EXPECT_EQ(m.opacity, 1);
  EXPECT_EQ(masked->vertex_of[1], kNoIndex);

  source.materials[0].alpha_mode = AlphaMode::Blend;
  const auto blended = resolve(source, 10);
  ASSERT_TRUE(blended);
  double covered = 0;
  for (size_t f = 0; f < blended->surface.triangles.size(); ++f) {
    covered += area_of(blended->surface, f) * blended->surface.materials[f].opacity;
  }
  EXPECT_NEAR(covered, 0.25, 0.005);
}

TEST(Resolve, NothingLeftIsAnError) {
  SourceSurface source = square();
  source.materials[0].alpha_mode = AlphaMode::Blend;
  source.materials[0].alpha = 0;
  const auto resolved = resolve(source, 1);
  ASSERT_FALSE(resolved);
  EXPECT_EQ(resolved.error().code, ErrorCode::BadFile);
}

TEST(Resolve, SmoothNormalsSplitCurvedFacesAndStayInTheMatrix) {
  SourceSurface source = square();
  const float s = std::sqrt(0.5f);
  for (const uvec3& t : source.triangles) {
    for (int k = 0; k < 3; ++k)
      source.corner_normal.push_back(source.positions[t[k]].x > 0 ? vec3(s, 0, s) : vec3(-s, 0, s));
  }
  const auto coarse = resolve(source, 10);
  ASSERT_TRUE(coarse);
  ASSERT_EQ(coarse->surface.triangles.size(), 2u);
  for (const FaceMaterial& m : coarse->surface.materials) {
    EXPECT_NEAR(m.shading_sggx.trace(), 1, 1e-4);
    EXPECT_GT(m.shading_sggx.xx, 0.05f);
    EXPECT_NEAR(m.sggx.zz, 1, 1e-6);  // geometry stays geometry
  }
  const auto fine = resolve(source, 0.1f);
  ASSERT_TRUE(fine);
  EXPECT_GT(fine->surface.triangles.size(), 50u);
  for (const FaceMaterial& m : fine->surface.materials) EXPECT_LT(m.shading_sggx.trace() - m.shading_sggx.zz, 0.6f);
}

TEST(Resolve, TheSpreadOfNormalMapsWidensTheMatrix) {
  SourceSurface source = square();
  const vec3 a = glm::normalize(vec3(1, 0, 2)), b = glm::normalize(vec3(-1, 0, 2));
  source.materials[0].normal_map.image = image(64, [&](int x, int) { return vec4(0.5f * (x % 2 ? a : b) + 0.5f, 1); });
  const auto resolved = resolve(source, 10);
  ASSERT_TRUE(resolved);
  const SymMat3& s = resolved->surface.materials[0].shading_sggx;
  EXPECT_NEAR(s.trace(), 1, 1e-4);
  EXPECT_NEAR(1 - s.zz, a.x * a.x, 0.02f);  // as far from the mean as the normals are
}

TEST(Resolve, AHostsFunctionIsAskedEverywhere) {
  SourceSurface source = square();
  source.material_function = [](const MaterialQuery& query) {
    MaterialSample sample;
    sample.diffuse = vec3(query.uv.x < 0.5f ? 1.0f : 0.0f);
    return sample;
  };
  const auto resolved = resolve(source, 1.0f / 16);
  ASSERT_TRUE(resolved);
  double mean = 0;
  for (size_t f = 0; f < resolved->surface.triangles.size(); ++f) {
    mean += area_of(resolved->surface, f) * resolved->surface.materials[f].diffuse.x;
  }
  EXPECT_NEAR(mean, 0.5, 0.02);
  EXPECT_NEAR(border_length(resolved->surface), 4, 1e-5);
}

TEST(Resolve, CanBeCancelled) {
  std::atomic<bool> cancel{true};
  const auto resolved = resolve(square(), 1, {{}, &cancel});
  ASSERT_FALSE(resolved);
  EXPECT_EQ(resolved.error().code, ErrorCode::Cancelled);
}

TEST(AverageFaces, KeepsTrianglesAndAverages) {
  SourceSurface source = square();
  source.corner_color = {vec4(1), vec4(0, 1, 1, 1), vec4(1), vec4(1), vec4(1), vec4(1)};
  source.materials[0].emission = {4, 5, 6};
  const Surface surface = average_faces(source);
  ASSERT_EQ(surface.triangles, source.triangles);
  EXPECT_NEAR(surface.materials[0].diffuse.x, 2.0f / 3, 1e-5);
  EXPECT_EQ(surface.materials[1].diffuse, vec3(1.0f));
  EXPECT_EQ(surface.materials[0].emission, vec3(4, 5, 6));
  EXPECT_EQ(surface.materials[0].shading_sggx, SymMat3());  // the source has no such normals
}

}  // namespace
}  // namespace farfield
