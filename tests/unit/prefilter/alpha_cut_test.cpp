// SPDX-License-Identifier: Apache-2.0
#include "prefilter/alpha_cut.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <random>

#include "base/parallel.h"
#include "prefilter/condition.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/imported_surface.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

using namespace test;

using AlphaAt = std::function<float(float u, float v)>;

/// An n x n mask, sampled at texel centres.
SourceMaterial masked(int n, const AlphaAt& alpha) {
  std::vector<vec4> texels;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const float a = alpha((static_cast<float>(x) + 0.5f) / static_cast<float>(n),
                            (static_cast<float>(y) + 0.5f) / static_cast<float>(n));
      texels.emplace_back(1, 1, 1, std::clamp(a, 0.0f, 1.0f));
    }
  }
  SourceMaterial m;
  m.alpha_mode = AlphaMode::Mask;
  m.base_color_map = {std::make_shared<const Texture>(n, n, texels), Wrap::Clamp, Wrap::Clamp};
  return m;
}

/// Antialiased over about a texel, like a mask from a painting program. distance: inside positive, in units of the
/// image.
SourceMaterial shape(int n, const AlphaAt& distance) {
  return masked(n, [&](float u, float v) { return 0.5f + distance(u, v) * static_cast<float>(n); });
}

const MaskedTriangle kLower{{vec2(0, 0), vec2(1, 0), vec2(1, 1)}}, kUpper{{vec2(0, 0), vec2(1, 1), vec2(0, 1)}};

/// Share of the unit square that is left of the two triangles of a card.
double card_coverage(const SourceMaterial& m, size_t* triangles = nullptr) {
  const MaskedTriangle card[] = {kLower, kUpper};
  const int n = cut_subdivisions(m, card);
  double sum = 0;
  for (const MaskedTriangle& t : card) {
    const CutPattern cut = cut_by_mask(m, t, n);
    sum += 0.5 * cut.coverage;
    if (triangles) *triangles += cut.triangles.size();
  }
  return sum;
}

TEST(AlphaCut, CoverageOfADiscAndARingIsTheirArea) {
  const auto radius = [](float u, float v) { return std::hypot(u - 0.45f, v - 0.52f); };
  const SourceMaterial disc = shape(128, [&](float u, float v) { return 0.3f - radius(u, v); });
  EXPECT_NEAR(card_coverage(disc) / (kPi * 0.09), 1, 0.006);
  const SourceMaterial ring = shape(128, [&](float u, float v) { return 0.1f - std::abs(radius(u, v) - 0.3f); });
  EXPECT_NEAR(card_coverage(ring) / (kPi * (0.16 - 0.04)), 1, 0.006);
}

TEST(AlphaCut, CoverageOfRandomBlobsIsTheShareOfTexelsAboveTheCutoff) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<float> any(-1, 1);
  for (int run = 0; run < 20; ++run) {
    std::array<float, 12> a;
    for (float& f : a) f = any(rng);
    const auto wave = [&](float u, float v) {
      float sum = 0;
      for (size_t k = 0; k < 4; ++k)
        sum += a[3 * k] * std::sin(12 * a[3 * k + 1] * u + 12 * a[3 * k + 2] * v + static_cast<float>(k));
      return sum;
    };
    const int n = 256;
    const SourceMaterial m = masked(n, [&](float u, float v) { return 0.5f + wave(u, v); });
    const Texture& im = *m.base_color_map.image;
    double share = 0;
    for (int i = 0; i < n * n; ++i) share += im.texel(im.level(0), i % n, i / n).w >= 0.5f ? 1.0 / (n * n) : 0;
    EXPECT_NEAR(card_coverage(m), share, 0.01 * share + 1e-4) << "run " << run;
  }
}

TEST(AlphaCut, CoarseOutlinesHaveFewTrianglesAndTheSameArea) {
  // A flower of seven petals; chords of 12 texels, which alone would lose a percent and more.
  const SourceMaterial m = shape(512, [](float u, float v) {
    return 0.3f + 0.12f * std::sin(7 * std::atan2(v - 0.5f, u - 0.5f)) - std::hypot(u - 0.5f, v - 0.5f);
  });
  size_t fine = 0, coarse = 0;
  const MaskedTriangle card[] = {kLower, kUpper};
  const int n = cut_subdivisions(m, card);
  for (const MaskedTriangle& t : card) {
    const CutPattern exact = cut_by_mask(m, t, n, 0.25), rough = cut_by_mask(m, t, n, 12);
    EXPECT_NEAR(rough.coverage, exact.coverage, 0.006f * exact.coverage);
    fine += exact.triangles.size();
    coarse += rough.triangles.size();
  }
  EXPECT_LT(4 * coarse, fine) << coarse << " and " << fine;
}

TEST(AlphaCut, TexelsAreMeasuredOnTheTriangle) {
  const SourceMaterial m = masked(8, [](float, float) { return 1.0f; });
  const std::array<vec3, 3> corners = {vec3(0, 0, 0), vec3(16, 0, 0), vec3(16, 4, 0)};
  EXPECT_NEAR(texel_size(m, kLower, corners), 2, 1e-6);
  EXPECT_EQ(texel_size(m, {{vec2(0, 0), vec2(0, 0), vec2(1, 1)}}, corners), 0);
  EXPECT_EQ(texel_size(m, {{vec2(NAN, 0), vec2(1, 0), vec2(0, 1)}}, corners), 0);
}

TEST(AlphaCut, TrianglesOfThePiecesAreWoundLikeTheWholeAndDoNotOverlap) {
  // Not overlapping: none is turned over and the areas add up to the coverage, which the outline alone gives.
  const SourceMaterial m =
      shape(64, [](float u, float v) { return 0.2f - std::abs(std::hypot(u - 0.5f, v - 0.5f) - 0.28f); });
  for (const auto& order : {std::array<size_t, 3>{0, 1, 2}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}}) {
    MaskedTriangle t;
    for (size_t k = 0; k < 3; ++k) t.uv[k] = kLower.uv[order[k]];
    const CutPattern cut = cut_by_mask(m, t, 64);
    double sum = 0;
    for (const uvec3& piece : cut.triangles) {
      const vec3 &a = cut.vertices[piece.x], &b = cut.vertices[piece.y], &c = cut.vertices[piece.z];
      const double area = double(b.y - a.y) * (c.z - a.z) - double(b.z - a.z) * (c.y - a.y);
      EXPECT_GT(area, 0);
      sum += area;
    }
    EXPECT_NEAR(sum, cut.coverage, 1e-5);
    EXPECT_NEAR(cut.coverage, cut_by_mask(m, kLower, 64).coverage, 1e-6);
  }
}

TEST(AlphaCut, FullAndEmptyMasksKeepOrDropTheWholeTriangle) {
  EXPECT_TRUE(cut_by_mask(masked(8, [](float, float) { return 1.0f; }), kLower, 16).is_whole());
  EXPECT_TRUE(cut_by_mask(masked(8, [](float, float) { return 0.2f; }), kLower, 16).triangles.empty());
  SourceMaterial at_cutoff = masked(1, [](float, float) { return 1.0f; });
  at_cutoff.alpha = at_cutoff.alpha_cutoff = 0.25f;  // alpha >= cutoff stays [Khronos 2021, 3.9.4]
  EXPECT_TRUE(cut_by_mask(at_cutoff, kLower, 1).is_whole());
}

TEST(AlphaCut, VertexAlphaCutsWithoutAnyTexture) {
  SourceMaterial m;
  m.alpha_mode = AlphaMode::Mask;
  const MaskedTriangle ramp{{}, {0, 1, 1}};
  const CutPattern cut = cut_by_mask(m, ramp, 32);
  EXPECT_NEAR(cut.coverage, 0.75, 1e-3);  // the corner with alpha below a half is a quarter of the area
}

TEST(AlphaCut, UnusableCoordinatesLeaveTheTriangleWhole) {
  const SourceMaterial m = masked(8, [](float, float) { return 0.0f; });
  EXPECT_TRUE(cut_by_mask(m, {{vec2(NAN, 0), vec2(1, 0), vec2(0, 1)}}, 16).is_whole());
}

TEST(AlphaCut, StepsOfAStaircaseCostFewTriangles) {
  // A hard-edged disc: hundreds of texel steps, but a simple outline.
  const SourceMaterial m =
      masked(256, [](float u, float v) { return std::hypot(u - 0.5f, v - 0.5f) < 0.4f ? 1.0f : 0.0f; });
  size_t triangles = 0;
  EXPECT_NEAR(card_coverage(m, &triangles) / (kPi * 0.16), 1, 0.01);
  EXPECT_LT(triangles, 100u);
}

// ---- as part of a mesh

/// A bent strip of n cards side by side that share vertices, the mask running across all of them, as a glTF file.
std::filesystem::path write_strip(const TemporaryFolder& folder, int n, const std::string& image) {
  std::vector<float> positions, uvs;
  std::vector<uint16_t> indices;
  for (int i = 0; i <= n; ++i) {
    const float x = static_cast<float>(i) / static_cast<float>(n);
    for (int k = 0; k < 2; ++k) {
      positions.insert(positions.end(), {x, static_cast<float>(k), 0.2f * std::sin(5 * x)});
      uvs.insert(uvs.end(), {x, static_cast<float>(k)});
    }
    if (i == n) break;
    const auto a = static_cast<uint16_t>(2 * i);
    for (const int d : {0, 2, 3, 0, 3, 1}) indices.push_back(static_cast<uint16_t>(a + d));
  }
  const std::string p = raw(positions), t = raw(uvs), f = raw(indices);
  const std::string json = fmt::format(
      R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
      "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
      "materials":[{{"alphaMode":"MASK","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},"metallicFactor":0}}}}],
      "textures":[{{"source":0}}],"images":[{{"bufferView":3,"mimeType":"image/png"}}],
      "accessors":[{{"bufferView":0,"componentType":5126,"count":{0},"type":"VEC3"}},
      {{"bufferView":1,"componentType":5126,"count":{0},"type":"VEC2"}},
      {{"bufferView":2,"componentType":5123,"count":{1},"type":"SCALAR"}}],
      "bufferViews":[{{"buffer":0,"byteLength":{2}}},{{"buffer":0,"byteOffset":{2},"byteLength":{3}}},
      {{"buffer":0,"byteOffset":{4},"byteLength":{5}}},{{"buffer":0,"byteOffset":{6},"byteLength":{7}}}],
      "buffers":[{{"byteLength":{8}}}]}})",
      2 * (n + 1), indices.size(), p.size(), t.size(), p.size() + t.size(), f.size(), p.size() + t.size() + f.size(),
      image.size(), p.size() + t.size() + f.size() + image.size());
  return folder.write("strip.glb", glb(json, p + t + f + image));
}

TEST(AlphaCut, NeighboursFitWithoutCracksOrTJunctions) {
  // Wavy holes across all cards. Wherever the cut mesh has a border edge, there has to be a reason for it: both ends on
  // the border of the strip, or the edge runs along the mask's outline, never along an edge inside the strip.
  const int size = 128, cards = 7;
  std::vector<std::array<uint8_t, 4>> texels;
  const auto alpha = [](float u, float v) { return 0.5f + 0.5f * std::sin(20 * u + 3 * v) * std::cos(17 * v - 4 * u); };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      texels.push_back({255, 0, 0,
                        static_cast<uint8_t>(255 * alpha((static_cast<float>(x) + 0.5f) / size,
                                                         (static_cast<float>(y) + 0.5f) / size))});
    }
  }
  const TemporaryFolder folder;
  const auto asset = test::import_surface(write_strip(folder, cards, png(size, size, texels)));
  ASSERT_TRUE(asset) << asset.error().message;
  const Surface& s = asset->surface;
  EXPECT_GT(s.triangles.size(), 50u);
  std::map<std::pair<uint32_t, uint32_t>, int> faces_at;
  for (const uvec3& t : s.triangles) {
    for (int k = 0; k < 3; ++k) ++faces_at[std::minmax(t[k], t[(k + 1) % 3])];
  }
  // Inner edges of the strip: x = i / cards, and the diagonals y = x cards - i.
  const auto on_inner_edge = [&](const vec3& p, const vec3& q) {
    for (int i = 0; i <= cards; ++i) {
      const float x = static_cast<float>(i) / cards;
      if (i > 0 && i < cards && std::abs(p.x - x) < 1e-6f && std::abs(q.x - x) < 1e-6f) return true;
      const auto off_diagonal = [&](const vec3& v) { return std::abs(v.y - (v.x * cards - static_cast<float>(i))); };
      if (off_diagonal(p) < 1e-5f && off_diagonal(q) < 1e-5f) return true;
    }
    return false;
  };
  int on_inner = 0;
  for (const auto& [edge, count] : faces_at) {
    EXPECT_LE(count, 2);
    const vec3 &p = s.positions[edge.first], &q = s.positions[edge.second];
    if (!on_inner_edge(p, q)) continue;
    ++on_inner;
    EXPECT_EQ(count, 2) << fmt::format("({}, {}) - ({}, {})", p.x, p.y, q.x, q.y);
  }
  EXPECT_GT(on_inner, 2 * cards);
  for (const FaceMaterial& m : s.materials) EXPECT_GT(m.diffuse.x, 0.9f);
}

TEST(AlphaCut, SameMeshForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  std::vector<std::array<uint8_t, 4>> texels;
  for (int i = 0; i < 64 * 64; ++i) texels.push_back({200, 100, 50, static_cast<uint8_t>((i * 37 / 64) % 256)});
  const auto file = write_strip(folder, 9, png(64, 64, texels));
  const auto with_threads = [&](int threads) {
    const ThreadLimit limit(threads);
    return test::import_surface(file);
  };
  const auto first = with_threads(1), second = with_threads(4);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->surface.positions, second->surface.positions);
  EXPECT_EQ(first->surface.triangles, second->surface.triangles);
  for (size_t i = 0; i < first->surface.materials.size(); ++i) {
    ASSERT_EQ(first->surface.materials[i].diffuse, second->surface.materials[i].diffuse) << i;
  }
  EXPECT_EQ(first->source_hash, second->source_hash);
}

}  // namespace
}  // namespace farfield
