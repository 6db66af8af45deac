// SPDX-License-Identifier: Apache-2.0
// farfield/bake.h as a host calls it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <map>

#include "bake/measure_levels.h"
#include "bake_api/gather_mesh.h"
#include "bake_api/source_from_input.h"
#include "cache/level_file.h"
#include "cache/manifest.h"
#include "cache/placed_parts.h"
#include "farfield/bake.h"
#include "prefilter/condition.h"
#include "prefilter/subdivide.h"
#include "tests/support/files.h"
#include "tests/support/png_files.h"
#include "tests/support/raise_to.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using glm::vec2, glm::vec3, glm::vec4;

template <typename T>
ErrorCode code_of(const Result<T>& result) {
  EXPECT_FALSE(result);
  return result ? ErrorCode::InvalidArgument : result.error().code;
}

/// A sphere of quads under a cloud of leaf cards: surface that stays and surface that becomes volume.
struct Tree {
  std::vector<vec3> points;
  std::vector<uint32_t> corners, counts, materials;
  std::vector<vec2> uv;

  Tree() {
    constexpr int kSides = 24;
    const auto ball = [](int i, int j) {
      const float phi = 6.2831853f * static_cast<float>(i % kSides) / kSides;
      const float theta = 3.1415927f * static_cast<float>(j) / kSides;
      return vec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
    };
    for (int i = 0; i < kSides; ++i)
      for (int j = 1; j < kSides - 1; ++j) add({ball(i, j), ball(i + 1, j), ball(i + 1, j + 1), ball(i, j + 1)}, 0);
    for (int i = 0; i < 400; ++i) {
      const float turn = 2.4f * static_cast<float>(i);
      const vec3 at(1.5f * std::cos(turn), 1.2f + 0.002f * static_cast<float>(i), 1.5f * std::sin(turn));
      const vec3 side = 0.04f * vec3(std::cos(3 * turn), std::sin(5 * turn), std::sin(turn));
      add({at, at + side, at + side + vec3(0, 0.05f, 0), at + vec3(0, 0.05f, 0)}, 1);
    }
  }

  void add(const std::vector<vec3>& polygon, uint32_t material) {
    for (size_t i = 0; i < polygon.size(); ++i) {
      corners.push_back(static_cast<uint32_t>(points.size()));
      points.push_back(polygon[i]);
      uv.emplace_back(i == 1 || i == 2, i >= 2);
    }
    counts.push_back(static_cast<uint32_t>(polygon.size()));
    materials.push_back(material);
  }

  BakeInput input() const {
    BakeInput input;
    input.name = "tree.obj";
    BakeMesh& mesh = input.meshes.emplace_back();
    mesh.points = points;
    mesh.corners = corners;
    mesh.counts = counts;
    mesh.materials = materials;
    mesh.uv = {uv, BakePer::Corner};
    input.materials.resize(2);
    input.materials[0].base_color = {0.5f, 0.25f, 0.125f};
    input.materials[1].base_color = {1, 1, 1};
    return input;
  }

  /// The same as a file, with digits enough for every float.
  void write_obj(const test::TemporaryFolder& folder) const {
    std::string text = "mtllib tree.mtl\n";
    for (const vec3& p : points) text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", p.x, p.y, p.z);
    for (const vec2& t : uv) text += fmt::format("vt {:.9g} {:.9g}\n", t.x, 1 - t.y);  // v up
    size_t corner = 0;
    for (size_t face = 0; face < counts.size(); ++face) {
      text += materials[face] == 0 ? "usemtl bark\nf" : "usemtl leaf\nf";
      for (uint32_t i = 0; i < counts[face]; ++i, ++corner) {
        text += fmt::format(" {}/{}", corners[corner] + 1, corner + 1);
      }
      text += "\n";
    }
    folder.write("tree.obj", text);
    folder.write("tree.mtl", "newmtl bark\nKd 0.5 0.25 0.125\nnewmtl leaf\nKd 1 1 1\nmap_Kd leaf.png\n");
    folder.write("leaf.png", leaf_png());
  }
  // sRGB and linear agree at 0 and 255.
  static std::string leaf_png() { return test::png(2, 1, {{0, 255, 0, 255}, {255, 255, 0, 255}}); }
};

BakeSettings small_settings() {
  BakeSettings settings;
  settings.finest_grid = 32;
  settings.coarsest_grid = 8;
  settings.rays_per_voxel = 20;
  return settings;
}

/// The level files of an asset by name.
std::map<std::string, std::vector<std::byte>> level_bytes(const fs::path& asset) {
  std::map<std::string, std::vector<std::byte>> bytes;
  for (const auto& entry : fs::directory_iterator(asset)) {
    if (entry.path().extension() == ".ffl") bytes[entry.path().filename()] = test::read_bytes(entry.path());
  }
  return bytes;
}

class BakeApi : public testing::Test {
 protected:
  std::string out(const std::string& name = "tree") const { return folder_.path() / (name + ".farfield"); }

  const test::TemporaryFolder folder_;
  const Tree tree_;
};

TEST_F(BakeApi, ArraysBakeToTheSameBytesAsTheFileThatHoldsThem) {
  tree_.write_obj(folder_);
  const auto of_file = bake_file(folder_.path() / "tree.obj", out("file"), small_settings());
  ASSERT_TRUE(of_file) << of_file.error().message;
  EXPECT_TRUE(of_file->warnings.empty()) << of_file->warnings[0];
  ASSERT_GT(of_file->levels.size(), 1u);

  BakeInput input = tree_.input();
  const std::vector<vec4> pixels = {{0, 1, 0, 1}, {1, 1, 0, 1}};
  input.materials[1].base_color_texture.pixels = pixels;
  input.materials[1].base_color_texture.width = 2;
  input.materials[1].base_color_texture.height = 1;
  input.materials[0].name = "bark";
  input.materials[1].name = "leaf";
  const auto of_memory = bake_meshes(input, out("memory"), small_settings());
  ASSERT_TRUE(of_memory) << of_memory.error().message;
  EXPECT_EQ(level_bytes(out("file")), level_bytes(out("memory")));
  EXPECT_EQ(of_memory->levels.size(), of_file->levels.size());
  EXPECT_EQ(of_memory->levels[0].triangles, 2 * tree_.counts.size());
  EXPECT_EQ(of_memory->levels[0].file_bytes, fs::file_size(fs::path(out("memory")) / "level_0.ffl"));
}

TEST_F(BakeApi, InstancesBakeLikeTheMeshesThatTheyShow) {
  BakeInput once = tree_.input(), shown = tree_.input();
  glm::dmat4x3 away(1.0);
  away[3] = {4, 0, 0};
  shown.instances = {{0, glm::dmat4x3(1.0)}, {0, away}};
  std::vector<vec3> moved = tree_.points;
  for (vec3& point : moved) point += vec3(4, 0, 0);
  once.meshes.push_back(once.meshes[0]);
  once.meshes[1].points = moved;
  ASSERT_TRUE(bake_meshes(once, out("once"), small_settings()));
  ASSERT_TRUE(bake_meshes(shown, out("shown"), small_settings()));
  const auto of_once = level_bytes(out("once")), of_shown = level_bytes(out("shown"));
  ASSERT_EQ(of_once.size(), of_shown.size());
  // The sums differ by a rounding, so the bytes may; what there is does not.
  for (const auto& [name, bytes] : of_once) EXPECT_EQ(bytes.size(), of_shown.at(name).size()) << name;
}

TEST_F(BakeApi, KnowsWhatItHasBakedAlready) {
  BakeInput input = tree_.input();
  EXPECT_FALSE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
  EXPECT_TRUE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
  input.materials[0].base_color.x = 0.25f;
  EXPECT_FALSE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
}

TEST_F(BakeApi, AFunctionIsBakedAnewUnlessAKeyStandsForIt) {
  BakeInput input = tree_.input();
  input.material_function = [](const MaterialQuery&) { return MaterialSample{}; };
  EXPECT_FALSE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
  EXPECT_FALSE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
  input.material_key = "grey, 1";
  EXPECT_FALSE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
  EXPECT_TRUE(bake_meshes(input, out(), small_settings()).value().is_up_to_date);
}

TEST_F(BakeApi, AFunctionThatSaysWhatDescriptionsSayBakesToTheSameLevels) {
  BakeInput described = tree_.input(), asked = tree_.input();
  asked.materials.clear();
  asked.material_function = [colors = described.materials](const MaterialQuery& query) {
    MaterialSample sample;
    sample.diffuse = colors[query.material].base_color;
    return sample;
  };
  // Without texture coordinates: with them level 0 takes more if there is a function to be asked, so that other levels
  // are worth their bytes.
  described.meshes[0].uv = asked.meshes[0].uv = {};
  const BakeSummary of_described = bake_meshes(described, out("described"), small_settings()).value();
  const BakeSummary of_asked = bake_meshes(asked, out("asked"), small_settings()).value();
  ASSERT_EQ(of_described.levels.size(), of_asked.levels.size());
  for (size_t i = 0; i < of_asked.levels.size(); ++i) {
    EXPECT_EQ(of_asked.levels[i].level, of_described.levels[i].level);
    EXPECT_EQ(of_asked.levels[i].triangles, of_described.levels[i].triangles);
    EXPECT_EQ(of_asked.levels[i].voxels, of_described.levels[i].voxels);
  }
}

TEST_F(BakeApi, TellsHowFarItIs) {
  BakeSettings settings = small_settings();
  std::vector<double> done;
  std::vector<std::string> stages;
  settings.progress = [&](double part, const std::string& stage) {
    done.push_back(part);
    stages.push_back(stage);
  };
  ASSERT_TRUE(bake_meshes(tree_.input(), out(), settings));
  ASSERT_GT(done.size(), 5u);
  EXPECT_EQ(done.front(), 0.0);
  EXPECT_EQ(done.back(), 1.0);
  EXPECT_EQ(stages.front(), "import");
  EXPECT_NE(std::find(stages.begin(), stages.end(), "level 1: voxelise"), stages.end());
}

TEST_F(BakeApi, StopsWhenTold) {
  std::atomic<bool> cancel{false};
  BakeSettings settings = small_settings();
  settings.cancel = &cancel;
  settings.progress = [&](double, const std::string& stage) { cancel = cancel || stage == "level 1: voxelise"; };
  const auto baked = bake_meshes(tree_.input(), out(), settings);
  ASSERT_FALSE(baked);
  EXPECT_EQ(baked.error().code, ErrorCode::Cancelled);
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(BakeApi, AFunctionThatTakesManyPlacesBakesTheSame) {
  BakeInput input = tree_.input();
  input.material_function = [](const MaterialQuery& query) {
    MaterialSample sample;
    sample.diffuse = {query.uv.x, 0.5f * query.uv.y, query.material == 1 ? 0.75f : 0.25f};
    return sample;
  };
  ASSERT_TRUE(bake_meshes(input, out("one"), small_settings()));
  std::atomic<size_t> most{0};
  input.material_batch_function = [ask = input.material_function, &most](const MaterialQuery* queries,
                                                                         MaterialSample* samples, size_t count) {
    for (size_t i = 0; i < count; ++i) samples[i] = ask(queries[i]);
    test::raise_to(most, count);
  };
  input.material_function = {};
  ASSERT_TRUE(bake_meshes(input, out("many"), small_settings()));
  EXPECT_GT(most, 1000u);
  EXPECT_EQ(level_bytes(out("one")), level_bytes(out("many")));
}

TEST_F(BakeApi, HearsACancelBeforeItCopiesOrWelds) {
  std::atomic<bool> cancel{true};
  const Job job{{}, &cancel};
  BakeInput input = tree_.input();
  EXPECT_EQ(code_of(gather_mesh(input, job)), ErrorCode::Cancelled);
  EXPECT_EQ(code_of(source_from_input(input, job)), ErrorCode::Cancelled);
  EXPECT_EQ(code_of(condition(gather_mesh(input).value(), "tree", job)), ErrorCode::Cancelled);
  input.meshes[0].corners = {};  // its counts are wrong now: a cancelled check does not blame the input
  EXPECT_EQ(code_of(gather_mesh(input, job)), ErrorCode::Cancelled);
}

TEST_F(BakeApi, AnErrorHasTheWarningsThatCameBeforeIt) {
  BakeInput input = tree_.input();
  input.meshes.emplace_back().name = "nothing";
  const std::vector<std::string> wanted = {"mesh 1 (nothing): has no faces"};
  input.materials[0].roughness = 2;
  EXPECT_EQ(bake_meshes(input, out(), small_settings()).error().warnings, wanted);
  input = tree_.input();
  input.meshes.emplace_back().name = "nothing";
  input.instances = {{0, glm::dmat4x3(glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(0))}};
  input.instances[0].to_asset *= 1e12;  // too large to condition
  EXPECT_EQ(bake_meshes(input, out(), small_settings()).error().warnings, wanted);
}

TEST_F(BakeApi, KeepsToTheMemoryThatItMayTake) {
  BakeSettings settings = small_settings();
  settings.finest_grid = 512;
  settings.memory_limit_bytes = 1;
  const auto baked = bake_meshes(tree_.input(), out(), settings);
  ASSERT_FALSE(baked);
  EXPECT_EQ(baked.error().code, ErrorCode::OutOfBudget) << baked.error().message;
  EXPECT_FALSE(fs::exists(out()));
  settings = small_settings();
  settings.memory_limit_bytes = uint64_t{1} << 34;
  EXPECT_TRUE(bake_meshes(tree_.input(), out(), settings));
}

TEST_F(BakeApi, RefusesWhatItCannotDo) {
  const auto code_with = [&](auto spoil) {
    BakeSettings settings = small_settings();
    BakeInput input = tree_.input();
    spoil(settings, input);
    const auto baked = bake_meshes(input, out(), settings);
    EXPECT_FALSE(baked);
    EXPECT_FALSE(fs::exists(out()));
    return baked ? ErrorCode::Cancelled : baked.error().code;
  };
  EXPECT_EQ(code_with([](BakeSettings& s, BakeInput&) { s.finest_grid = 100; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_with([](BakeSettings& s, BakeInput&) { s.threads = -1; }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_with([](BakeSettings&, BakeInput& i) { i.meshes.clear(); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code_with([](BakeSettings&, BakeInput& i) { i.materials.pop_back(); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(bake_file(folder_.path() / "none.obj", out()).error().code, ErrorCode::NotFound);
}

/// [-1, 1]^3, three of whose edges may be sharp. Owns what `input` looks at.
struct Cube {
  std::vector<vec3> points;
  std::vector<uint32_t> corners = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  std::vector<int> counts = std::vector<int>(6, 4);
  std::vector<glm::ivec2> creases = {{0, 1}, {1, 3}, {3, 2}, {2, 0}};
  std::vector<float> sharpness = std::vector<float>(4, 10.0f);

  Cube() {
    for (int i = 0; i < 8; ++i) points.emplace_back(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  }
  BakeInput input(bool creased) const {
    BakeInput input;
    input.meshes.resize(1);
    input.meshes[0].points = points;
    input.meshes[0].corners = corners;
    input.meshes[0].counts = counts;
    if (creased) {
      input.meshes[0].creases = creases;
      input.meshes[0].crease_sharpness = sharpness;
    }
    return input;
  }
};

/// For level 0 alone.
BakeSettings source_only() {
  BakeSettings settings;
  settings.finest_grid = 32;
  settings.source_only = true;
  return settings;
}

/// A cube, and where it is baked.
class BakeApiCage : public ::testing::Test {
 protected:
  const Cube cube;
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "cube.farfield").string();
};

TEST_F(BakeApiCage, IsBakedSmooth) {
  BakeSettings settings = source_only();
  const auto flat = bake_meshes(cube.input(false), out, settings);
  ASSERT_TRUE(flat) << flat.error().message;
  EXPECT_EQ(flat->levels[0].triangles, 12u);
  settings.subdivision.scheme = BakeSubdivision::Scheme::CatmullClark;
  const auto smooth = bake_meshes(cube.input(false), out, settings);
  ASSERT_TRUE(smooth) << smooth.error().message;
  EXPECT_GT(smooth->levels[0].triangles, 200u);
  EXPECT_TRUE(smooth->warnings.empty());
  EXPECT_TRUE(bake_meshes(cube.input(false), out, settings)->is_up_to_date);
  const auto creased = bake_meshes(cube.input(true), out, settings);
  ASSERT_TRUE(creased) << creased.error().message;
  EXPECT_FALSE(creased->is_up_to_date) << "creases are part of the input";
  settings.subdivision.error = 1;
  const auto coarse = bake_meshes(cube.input(true), out, settings);
  ASSERT_TRUE(coarse) << coarse.error().message;
  EXPECT_FALSE(coarse->is_up_to_date);
  EXPECT_LT(coarse->levels[0].triangles, creased->levels[0].triangles);
}

TEST_F(BakeApiCage, IsSimplifiedAsTheSettingsSay) {
  BakeSettings settings;
  settings.finest_grid = 32;
  settings.coarsest_grid = 16;
  settings.rays_per_voxel = 2;
  settings.subdivision.scheme = BakeSubdivision::Scheme::CatmullClark;
  settings.subdivision.edge = 1;
  settings.simplify = BakeSimplify::Loops;
  const auto loops = bake_meshes(cube.input(false), out, settings);
  ASSERT_TRUE(loops) << loops.error().message;
  EXPECT_NE(read_manifest(out)->options.find("simplify=loops"), std::string::npos);
  settings.simplify = BakeSimplify::Edges;
  const auto edges = bake_meshes(cube.input(false), out, settings);
  ASSERT_TRUE(edges) << edges.error().message;
  EXPECT_FALSE(edges->is_up_to_date);
  EXPECT_NE(loops->levels.back().triangles, edges->levels.back().triangles);
  EXPECT_EQ(loops->levels.back().triangles % 2, 0u) << "quads stay quads";
  settings.simplify = static_cast<BakeSimplify>(3);
  EXPECT_EQ(code_of(bake_meshes(cube.input(false), out, settings)), ErrorCode::InvalidArgument);
}

TEST_F(BakeApiCage, RefusesSubdivisionsThatMakeNoSense) {
  BakeSettings settings;
  settings.subdivision.scheme = BakeSubdivision::Scheme::Loop;  // of quads
  EXPECT_EQ(code_of(bake_meshes(cube.input(false), out, settings)), ErrorCode::InvalidArgument);
  settings.subdivision.scheme = static_cast<BakeSubdivision::Scheme>(7);
  EXPECT_EQ(code_of(bake_meshes(cube.input(false), out, settings)), ErrorCode::InvalidArgument);
  settings.subdivision.scheme = BakeSubdivision::Scheme::CatmullClark;
  settings.subdivision.error = -1;
  EXPECT_EQ(code_of(bake_meshes(cube.input(false), out, settings)), ErrorCode::InvalidArgument);
  EXPECT_FALSE(fs::exists(out));
}

/// A ribbon of quads that is shown 30 times, beside one that is not.
struct Ribbons {
  struct Ribbon {
    std::vector<vec3> points;
    std::vector<uint32_t> corners, counts;
  };
  std::array<Ribbon, 2> ribbons;

  Ribbons() {
    uint32_t quads = 200;
    for (Ribbon& ribbon : ribbons) {
      for (uint32_t i = 0; i <= quads; ++i) {
        const float along = static_cast<float>(i), angle = 0.1f * along;
        for (const float z : {0.0f, 0.2f})
          ribbon.points.emplace_back(std::cos(angle), 0.01f * along, z + std::sin(angle));
      }
      for (uint32_t i = 0; i < quads; ++i) {
        ribbon.corners.insert(ribbon.corners.end(), {2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2});
        ribbon.counts.push_back(4);
      }
      quads = 30;
    }
  }

  BakeInput input() const {
    BakeInput input;
    input.name = "ribbons";
    for (const Ribbon& ribbon : ribbons) {
      BakeMesh& mesh = input.meshes.emplace_back();
      mesh.points = ribbon.points;
      mesh.corners = ribbon.corners;
      mesh.counts = ribbon.counts;
    }
    input.instances = {{1, glm::dmat4x3(1.0)}};
    for (int i = 0; i < 30; ++i) {
      const double angle = i, scale = i % 3 == 2 ? -0.5 : 1.0;
      glm::dmat4x3 place(1.0);
      place[0] = scale * glm::dvec3(std::cos(angle), std::sin(angle), 0);
      place[1] = glm::dvec3(-std::sin(angle), std::cos(angle), 0);
      place[3] = glm::dvec3(10 + 3 * (i % 5), 3 * (i / 5), i);
      input.instances.push_back({0, place});
    }
    return input;
  }
};

/// Sums over the corners of a flat level's faces: of 1, x, y, z and of their products.
std::array<double, 10> moments_of(const LevelData& level) {
  std::array<double, 10> sums{};
  const auto add = [&](const uvec3& face) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p(level.positions[face[k]]);
      const double terms[] = {1, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.y * p.z, p.z * p.x};
      for (size_t i = 0; i < sums.size(); ++i) sums[i] += terms[i];
    }
  };
  for (const Quad& quad : level.quads) {
    add(quad.face(0));
    if (quad.is_pair()) add(quad.face(1));
  }
  return sums;
}

TEST(BakeApiParts, WhatIsShownManyTimesIsKeptOnceAndStandsWhereItStood) {
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "ribbons.farfield").string();
  const Ribbons ribbons;
  const BakeInput input = ribbons.input();
  const auto baked = bake_meshes(input, out, source_only());
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(baked->levels[0].triangles, 2 * 230u);
  EXPECT_EQ(read_manifest(out)->levels[0].placements, 30u);
  EXPECT_TRUE(verify_and_measure_asset(out).findings.empty());
  const auto file = LevelFile::open(fs::path(out) / "level_0.ffl", LevelCheck::Full);
  ASSERT_TRUE(file);
  ASSERT_TRUE((*file)->view().has_parts());

  // The same as meshes of their own, which nothing repeats.
  BakeInput apart = input;
  apart.meshes.clear();
  for (BakeInstance& instance : apart.instances) {
    apart.meshes.push_back(input.meshes[instance.mesh]);
    instance.mesh = static_cast<uint32_t>(apart.meshes.size() - 1);
  }
  const std::string flat_out = (folder.path() / "flat.farfield").string();
  const auto flat = bake_meshes(apart, flat_out, source_only());
  ASSERT_TRUE(flat) << flat.error().message;
  EXPECT_EQ(flat->levels[0].triangles, 2 * (30 + 30 * 200u));
  EXPECT_GT(flat->levels[0].resident_bytes, 6 * baked->levels[0].resident_bytes);
  const auto flat_file = LevelFile::open(fs::path(flat_out) / "level_0.ffl", LevelCheck::Full);
  ASSERT_TRUE(flat_file);
  const auto placed = moments_of(flattened((*file)->view())), meant = moments_of(copy_of((*flat_file)->view()));
  for (size_t i = 0; i < meant.size(); ++i) EXPECT_NEAR(placed[i], meant[i], 1e-5 * std::abs(meant[i])) << i;
}

TEST(BakeApiParts, LevelsAboveAreMadeOfAllPlacesAndDoNotMorphFromThem) {
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "ribbons.farfield").string();
  BakeSettings settings = small_settings();
  settings.finest_grid = 16;
  const Ribbons ribbons;
  const auto baked = bake_meshes(ribbons.input(), out, settings);
  ASSERT_TRUE(baked) << baked.error().message;
  const auto manifest = read_manifest(out);
  ASSERT_TRUE(manifest);
  ASSERT_GE(manifest->levels.size(), 2u);
  EXPECT_EQ(manifest->levels[0].placements, 30u);
  EXPECT_EQ(manifest->levels[1].placements, 0u);
  EXPECT_FALSE(manifest->levels[1].morph);
  EXPECT_GT(manifest->levels[1].voxels + manifest->levels[1].triangles, 0u);
  EXPECT_TRUE(verify_and_measure_asset(out).findings.empty());
  EXPECT_TRUE(bake_meshes(ribbons.input(), out, settings)->is_up_to_date);
}

TEST(BakeApiParts, SubdividedMeshesHaveEachPlaceForItself) {
  const test::TemporaryFolder folder;
  const std::string out = (folder.path() / "ribbons.farfield").string();
  BakeSettings settings = source_only();
  settings.subdivision.scheme = BakeSubdivision::Scheme::CatmullClark;
  const Ribbons ribbons;
  const auto baked = bake_meshes(ribbons.input(), out, settings);
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(read_manifest(out)->levels[0].placements, 0u);
  EXPECT_GT(baked->levels[0].triangles, 30 * 200u);
}

TEST_F(BakeApiCage, AMeshMayHaveASchemeOfItsOwn) {
  BakeSettings settings = source_only();
  BakeInput input = cube.input(false);
  input.meshes.push_back(input.meshes[0]);
  glm::dmat4x3 beside(1.0);
  beside[3] = glm::dvec3(4, 0, 0);
  input.instances = {{0, glm::dmat4x3(1.0)}, {1, beside}};
  const auto triangles = [&] {
    const auto baked = bake_meshes(input, out, settings);
    EXPECT_TRUE(baked) << baked.error().message;
    EXPECT_FALSE(baked->is_up_to_date) << "schemes are part of the input";
    return baked->levels[0].triangles;
  };
  const auto flat = triangles();
  EXPECT_EQ(flat, 24u);
  input.meshes[1].scheme = BakeSubdivision::Scheme::CatmullClark;
  const auto one = triangles();
  EXPECT_GT(one, 200u);
  settings.subdivision.scheme = BakeSubdivision::Scheme::CatmullClark;
  const auto both = triangles();
  EXPECT_EQ(both, 2 * (one - 12));
  input.meshes[0].scheme = BakeSubdivision::Scheme::None;
  EXPECT_EQ(triangles(), one);
  input.meshes[0].scheme = static_cast<BakeSubdivision::Scheme>(5);
  EXPECT_EQ(code_of(bake_meshes(input, out, settings)), ErrorCode::InvalidArgument);
}

/// A quad in z = 0, [0, 1]^2, raised by 0.1, once as it is and once three times as large.
TEST(BakeApiDisplacement, HeightsGrowWithInstancesAndAreKeptInTheHash) {
  const std::vector<glm::vec3> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<uint32_t> corners = {0, 1, 2, 3};
  const std::vector<uint32_t> counts = {4};
  const std::vector<glm::vec2> uv = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const std::vector<glm::vec4> pixels = {{0.4f, 0, 0, 1}};
  BakeMesh mesh;
  mesh.points = points;
  mesh.corners = corners;
  mesh.counts = counts;
  mesh.uv.values = uv;
  BakeMaterial material;
  material.height_texture.pixels = pixels;
  material.height_texture.width = material.height_texture.height = 1;
  material.height_gain = 0.5f;
  material.height_base = -0.1f;
  BakeInput input;
  input.meshes = {mesh};
  input.materials = {material};
  glm::dmat4x3 large(3.0);
  large[3] = glm::dvec3(2, 0, 0);
  input.instances = {{0, glm::dmat4x3(1.0)}, {0, large}};
  const SourceMesh source = source_from_input(input).value();
  const SourceMesh moved = subdivide(source, SubdivisionOptions{}, "quads").value();
  for (const uint32_t v : moved.corner_position) {
    const auto& p = moved.positions[v];
    EXPECT_NEAR(p.z, p.x > 1.5 ? 0.3 : 0.1, 1e-6) << p.x;
  }
  const uint64_t before = source.source_hash;
  input.materials[0].height_gain = 0.6f;
  EXPECT_NE(source_from_input(input)->source_hash, before);
  input.materials[0].height_gain = 0.5f;
  EXPECT_EQ(source_from_input(input)->source_hash, before);

  const test::TemporaryFolder folder;
  BakeSettings settings = source_only();
  const auto baked = bake_meshes(input, (folder.path() / "quads.farfield").string(), settings);
  ASSERT_TRUE(baked) << baked.error().message;
  settings.subdivision.detail = -1;
  EXPECT_EQ(code_of(bake_meshes(input, (folder.path() / "quads.farfield").string(), settings)),
            ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace farfield
