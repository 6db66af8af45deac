// SPDX-License-Identifier: Apache-2.0
#include "bake/bake.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <thread>
#include <tuple>

#include "bake/bake_workspace.h"
#include "bake/measure_levels.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "bvh/level_scene.h"
#include "bvh/ray_cost.h"
#include "cache/level_file.h"
#include "prefilter/cut_tile.h"
#include "prefilter/edge_table.h"
#include "tests/support/files.h"
#include "tests/support/random_unit.h"
#include "tests/support/source_surfaces.h"
#include "tests/support/surfaces.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// A folder of its own for each test, removed afterwards.
class Bake : public testing::Test {
 protected:
  fs::path out() const { return folder_ / "thing.farfield"; }
  fs::path partial() const { return folder_ / "thing.farfield.partial"; }

 private:
  test::TemporaryFolder temporary_;

 protected:
  const fs::path folder_ = temporary_.path();
};

/// Bytes of the arrays: stands for what the runtime would measure.
Result<LevelCost> array_bytes(const LevelView& level) {
  const uint64_t bytes = level.positions.size_bytes() + 3 * level.quads.size_bytes() + level.bricks.size_bytes() +
                         level.brick_table.size_bytes() + 10 * voxel_count(level);
  return LevelCost{bytes, bytes / 2};
}

BakeOptions small_options() {
  BakeOptions options;
  options.finest_grid = 32;
  options.coarsest_grid = 4;
  options.rays_per_voxel = 10;
  options.measure_resident = array_bytes;
  return options;
}

/// Three levels, of which each is stored.
BakeOptions all_pay_from_16() {
  BakeOptions options = small_options();
  options.finest_grid = 16;
  options.measure_resident = [](const LevelView& level) {
    return Result<LevelCost>(LevelCost{uint64_t{1000000} >> level.header.level, 1});
  };
  return options;
}

/// A ball of 2 * 32 * 16 triangles inside a cloud of leaves: surface at fine levels, leaves that become volume.
ImportedAsset ball_in_leaves() {
  test::LeafCloud cloud;
  cloud.count = 1500;
  Surface surface = test::leaf_cloud(cloud);
  constexpr uint32_t kAround = 32, kUp = 16;
  const auto first = static_cast<uint32_t>(surface.positions.size());
  const auto point = [](float theta, float phi) {
    return vec3(0.5f) + 0.3f * vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  };
  surface.positions.push_back(point(0, 0));
  for (uint32_t i = 1; i < kUp; ++i) {
    for (uint32_t j = 0; j < kAround; ++j) {
      surface.positions.push_back(point(kPi * float(i) / kUp, 2 * kPi * float(j) / kAround));
    }
  }
  surface.positions.push_back(point(kPi, 0));
  const auto at = [&](uint32_t i, uint32_t j) { return first + 1 + (i - 1) * kAround + j % kAround; };
  const auto last = static_cast<uint32_t>(surface.positions.size()) - 1;
  const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
    const vec3 &p = surface.positions[a], &q = surface.positions[b], &r = surface.positions[c];
    surface.triangles.push_back({a, b, c});
    FaceMaterial material;
    material.sggx = SymMat3::outer(glm::normalize(glm::cross(q - p, r - p)));
    material.diffuse = vec3(0.6f, 0.3f, 0.1f);
    surface.materials.push_back(material);
  };
  for (uint32_t j = 0; j < kAround; ++j) {
    add(first, at(1, j), at(1, j + 1));
    for (uint32_t i = 1; i + 1 < kUp; ++i) {
      add(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      add(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
    add(at(kUp - 1, j), last, at(kUp - 1, j + 1));
  }
  return test::asset_of(surface, 77);
}

/// 24 sheets of 1 x 24 with gaps, of 24 quads each.
Surface boards_apart(float gap) {
  Surface surface;
  for (uint32_t board = 0; board < 24; ++board) {
    const Surface sheet = test::make_plane(1, 24, 1 - gap, 24.0f);
    const auto first = static_cast<uint32_t>(surface.positions.size());
    for (const vec3& p : sheet.positions) surface.positions.push_back(p + vec3(board, 0, 0));
    for (const uvec3& t : sheet.triangles) surface.triangles.push_back(t + first);
  }
  test::add_materials(surface);
  return surface;
}
ImportedAsset boards(float gap = 0.06f) { return test::asset_of(boards_apart(gap), 78); }

/// Such boards, half of them gaps, on both sides of a black wall.
ImportedAsset boards_around_a_wall() {
  Surface surface = test::make_plane(24, 24, 24.0f, 24.0f);
  const size_t black = surface.triangles.size();
  const Surface row = boards_apart(0.5f);
  for (const float z : {-0.2f, 0.2f}) {
    const auto first = static_cast<uint32_t>(surface.positions.size());
    for (const vec3& p : row.positions) surface.positions.push_back(p + vec3(0, 0, z));
    for (const uvec3& t : row.triangles) surface.triangles.push_back(t + first);
  }
  test::add_materials(surface);
  for (size_t f = 0; f < black; ++f) surface.materials[f].diffuse = vec3(0.0f);
  return test::asset_of(surface, 79);
}

ImportedAsset two_triangles(float grey = 0.5f) {
  Surface surface;
  surface.positions = {vec3(0), vec3(4, 0, 0), vec3(4, 4, 0), vec3(0, 4, 0)};
  surface.triangles = {uvec3(0, 1, 2), uvec3(0, 2, 3)};
  FaceMaterial material;
  material.sggx = SymMat3::outer(vec3(0, 0, 1));
  material.diffuse = vec3(grey);
  surface.materials.assign(2, material);
  return test::asset_of(surface);
}

/// Every file below a folder, by relative name.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files[fs::relative(entry.path(), folder).string()] = std::string(std::istreambuf_iterator<char>(in), {});
  }
  return files;
}

/// The levels of a baked asset, opened and fully checked.
std::vector<std::unique_ptr<LevelFile>> open_levels(const fs::path& out) {
  std::vector<std::unique_ptr<LevelFile>> levels;
  const auto manifest = read_manifest(out);
  EXPECT_TRUE(manifest.has_value()) << manifest.error().message;
  for (const LevelEntry& entry : manifest->levels) {
    auto file = LevelFile::open(out / entry.file, LevelCheck::Full);
    EXPECT_TRUE(file.has_value()) << file.error().message;
    EXPECT_EQ((*file)->file_bytes(), entry.file_bytes);
    EXPECT_EQ((*file)->view().header.level, entry.level);
    EXPECT_EQ(face_count((*file)->view()), entry.triangles);
    EXPECT_EQ(voxel_count((*file)->view()), entry.voxels);
    levels.push_back(std::move(*file));
  }
  return levels;
}

/// Levels 16^3 to 4^3 of this and itself; none where the bake fails.
std::vector<std::unique_ptr<LevelFile>> bake_all_levels(ImportedAsset asset, const fs::path& out) {
  const auto report = bake(std::move(asset), "boards.obj", out, all_pay_from_16());
  EXPECT_TRUE(report) << report.error().message;
  if (!report) return {};
  return open_levels(out);
}

TEST_F(Bake, WritesACascadeThatOpensAndShrinks) {
  const auto report = bake(ball_in_leaves(), "thing.obj", out(), small_options());
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_FALSE(report->up_to_date);
  ASSERT_EQ(report->levels.size(), 5u);  // 0, 32, 16, 8, 4
  const auto levels = open_levels(out());
  ASSERT_GE(levels.size(), 3u);
  const auto manifest = read_manifest(out());
  EXPECT_EQ(manifest->source, "thing.obj");
  EXPECT_EQ(manifest->levels.front().level, 0u);
  EXPECT_EQ(manifest->levels.front().triangles, 3000u + 960u);
  EXPECT_EQ(manifest->levels.back().level, 4u);
  EXPECT_EQ(manifest->levels.back().grid, 4u);
  EXPECT_NEAR(manifest->base_resolution * 64, 1.0, 0.05);  // leaves reach a little beyond the unit cube
  for (size_t i = 1; i < manifest->levels.size(); ++i) {
    EXPECT_LT(manifest->levels[i].resident_bytes, manifest->levels[i - 1].resident_bytes);
    EXPECT_DOUBLE_EQ(manifest->levels[i].resolution,
                     std::ldexp(manifest->base_resolution, int(manifest->levels[i].level)));
  }
  EXPECT_FALSE(fs::exists(partial()));
  EXPECT_EQ(files_of(out()).size(), levels.size() + 1);  // nothing else is left
  // The leaves are volume at once, the ball stays surface for a while.
  EXPECT_EQ(report->levels[1].voxelized_triangles, 3000u);
  EXPECT_EQ(report->levels[1].macrosurface_triangles, 960u);
}

/// That each level's vertices and faces go to places of the next one: at t = 1 a morph is that, bit for bit.
void expect_complete_maps(const std::vector<std::unique_ptr<LevelFile>>& levels) {
  for (size_t i = 1; i < levels.size(); ++i) {
    const LevelView &fine = levels[i - 1]->view(), &coarse = levels[i]->view();
    ASSERT_EQ(fine.positions.size(), coarse.morph_vertex.size());
    ASSERT_EQ(face_count(fine), coarse.morph_face.size());
    const float reach = 2 * coarse.header.resolution;
    for (size_t q = 0; q < fine.quads.size(); ++q) {
      const Quad& quad = fine.quads[q];
      for (const uint32_t v : {quad.v0, quad.v1, quad.v2, quad.v3}) {
        const uint32_t target = coarse.morph_vertex[v];
        ASSERT_TRUE(target < coarse.positions.size() || target == kMorphVoxelized);
        if (target != kMorphVoxelized) {
          EXPECT_LT(glm::distance(fine.positions[v], coarse.positions[target]), reach);
        }
      }
      // A face that stays a face has the target's corners.
      for (uint32_t f = fine.quad_first_face[q]; f < fine.quad_first_face[q] + (quad.is_pair() ? 2 : 1); ++f) {
        const uint32_t target = coarse.morph_face[f];
        if (target == kMorphVoxelized || target == kMorphCollapsed) continue;
        ASSERT_LT(target, face_count(coarse));
        const auto corners = [](const LevelView& level, uint32_t face) {
          const auto above = std::upper_bound(level.quad_first_face.begin(), level.quad_first_face.end(), face);
          const auto index = static_cast<size_t>(above - level.quad_first_face.begin()) - 1;
          const Quad& quad_of = level.quads[index];
          return face == level.quad_first_face[index] ? uvec3(quad_of.v0, quad_of.v1, quad_of.v3)
                                                      : uvec3(quad_of.v2, quad_of.v3, quad_of.v1);
        };
        const uvec3 from = corners(fine, f), to = corners(coarse, target);
        std::array<uint32_t, 3> moved, wanted = {to.x, to.y, to.z};
        for (int c = 0; c < 3; ++c) moved[static_cast<size_t>(c)] = coarse.morph_vertex[from[c]];
        std::sort(moved.begin(), moved.end());
        std::sort(wanted.begin(), wanted.end());
        EXPECT_EQ(moved, wanted);
      }
    }
  }
}

TEST_F(Bake, MapsEveryVertexAndFaceToTheNextStoredLevel) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  expect_complete_maps(open_levels(out()));
}

TEST_F(Bake, QuadsStayQuadsWhereLoopsCollapse) {
  Surface cube = test::make_rounded_cube(40, 0.2f);
  test::pair_into_quads(cube);
  BakeOptions options = small_options();
  options.simplify = SimplifyMethod::Loops;
  ASSERT_TRUE(bake(test::asset_of(cube), "cube", out(), options).has_value());
  const auto levels = open_levels(out());
  ASSERT_GE(levels.size(), 3u);
  expect_complete_maps(levels);
  for (const auto& level : levels) {
    for (const Quad& quad : level->view().quads) EXPECT_TRUE(quad.is_pair());
  }
  EXPECT_LT(face_count(levels.back()->view()), face_count(levels.front()->view()) / 16);

  const uint32_t first = levels[1]->view().header.level;
  const std::string name = read_manifest(out())->levels[1].file;
  const std::string with_loops = files_of(out()).at(name);
  options.coarsest_grid = options.finest_grid >> (first - 1);  // further down auto may take edges
  options.simplify = SimplifyMethod::Auto;
  ASSERT_TRUE(bake(test::asset_of(cube), "cube", out(), options).has_value());
  EXPECT_TRUE(files_of(out()).at(name) == with_loops);
  options.simplify = SimplifyMethod::Edges;
  ASSERT_TRUE(bake(test::asset_of(cube), "cube", out(), options).has_value());
  EXPECT_FALSE(files_of(out()).at(name) == with_loops);
}

TEST_F(Bake, StoresAHullThatContainsAllLevels) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  const auto manifest = read_manifest(out());
  std::vector<vec3> points;
  for (const auto& level : open_levels(out())) {
    const LevelView& view = level->view();
    points.insert(points.end(), view.positions.begin(), view.positions.end());
    for (int cell = 0; cell < static_cast<int>(view.brick_table.size()); ++cell) {
      const uint32_t entry = view.brick_table[static_cast<size_t>(cell)];
      if (entry == kNoBrick) continue;
      const ivec3 dims = view.header.brick_dims;
      const ivec3 at = ivec3(cell % dims.x, cell / dims.x % dims.y, cell / dims.x / dims.y) * kBrickSide;
      for (int i = 0; i < kBrickVoxels; ++i) {
        if (view.bricks[entry].density[static_cast<size_t>(i)] == 0) continue;
        for (int c = 0; c < 8; ++c) {
          const ivec3 corner = at + ivec3(i & 7, i >> 3 & 7, i >> 6) + ivec3(c & 1, c >> 1 & 1, c >> 2);
          points.push_back(view.header.volume_origin + vec3(corner) * view.header.resolution);
        }
      }
    }
  }
  Rng rng(1);
  for (int i = 0; i < 300; ++i) {
    const vec3 direction = test::random_unit(rng);
    float furthest = -INFINITY, furthest_hull = -INFINITY;
    for (const vec3& p : points) furthest = std::max(furthest, glm::dot(p, direction));
    for (const vec3& p : manifest->hull) furthest_hull = std::max(furthest_hull, glm::dot(p, direction));
    EXPECT_LE(furthest, furthest_hull);
  }
  for (const vec3& p : points) {
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_GE(p[axis], manifest->bounds.lower[axis]);
      ASSERT_LE(p[axis], manifest->bounds.upper[axis]);
    }
  }
}

TEST_F(Bake, GivesTheSameBytesForAnyNumberOfThreads) {
  std::vector<std::map<std::string, std::string>> results;
  for (const int threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    const fs::path here = folder_ / std::to_string(threads);
    ASSERT_TRUE(bake(ball_in_leaves(), "thing", here, small_options()).has_value());
    results.push_back(files_of(here));
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST_F(Bake, ResumesAfterCancellingAnywhereToTheSameBytes) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", folder_ / "whole", small_options()).has_value());
  const auto whole = files_of(folder_ / "whole");
  // One bake per stage of the work, each cancelled in it: at its first report of progress, or its third if it has one.
  std::vector<std::pair<std::string, int>> stops = {{"level 0: write", 1}, {"level 1: voxelise", 3}};
  for (int level = 1; level <= 4; ++level) {
    for (const char* stage : {"analyse", "simplify", "voxelise", "write"}) {
      stops.push_back({"level " + std::to_string(level) + ": " + stage, 1});
    }
  }
  for (const auto& [stop_stage, stop_report] : stops) {
    std::atomic<bool> cancel{false};
    int reports = 0;
    double last = 0;
    BakeOptions options = small_options();
    options.job.cancel = &cancel;
    options.job.progress = [&](double done, const std::string& stage) {
      EXPECT_GE(done, last);
      EXPECT_LE(done, 1);
      last = done;
      if (stage == stop_stage && ++reports == stop_report) cancel = true;
    };
    const auto report = bake(ball_in_leaves(), "thing", out(), options);
    ASSERT_FALSE(report.has_value()) << stop_stage;
    ASSERT_EQ(report.error().code, ErrorCode::Cancelled);
    EXPECT_FALSE(fs::exists(out()));
  }
  const auto report = bake(ball_in_leaves(), "thing", out(), small_options());
  ASSERT_TRUE(report.has_value());
  for (const LevelReport& level : report->levels) EXPECT_EQ(level.resumed, level.level > 0) << level.level;
  EXPECT_EQ(files_of(out()), whole);
  EXPECT_FALSE(fs::exists(partial()));
}

TEST_F(Bake, IgnoresADamagedLeftover) {
  std::atomic<bool> cancel{false};
  BakeOptions options = small_options();
  options.job.cancel = &cancel;
  options.job.progress = [&](double, const std::string& stage) { cancel = cancel || stage == "level 3: analyse"; };
  ASSERT_FALSE(bake(ball_in_leaves(), "thing", out(), options).has_value());
  int damaged = 0;
  for (const auto& entry : fs::directory_iterator(partial())) {
    if (!entry.is_regular_file()) continue;
    fs::resize_file(entry.path(), fs::file_size(entry.path()) - 1000);
    ++damaged;
  }
  EXPECT_EQ(damaged, 2);
  const auto report = bake(ball_in_leaves(), "thing", out(), small_options());
  ASSERT_TRUE(report.has_value());
  for (const LevelReport& level : report->levels) EXPECT_FALSE(level.resumed);
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", folder_ / "whole", small_options()).has_value());
  EXPECT_EQ(files_of(out()), files_of(folder_ / "whole"));
}

TEST_F(Bake, DoesNothingWhenTheAssetIsUpToDate) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  const auto before = files_of(out());
  const auto time = fs::last_write_time(out() / "manifest.json");
  const auto report = bake(ball_in_leaves(), "thing", out(), small_options());
  ASSERT_TRUE(report.has_value());
  EXPECT_TRUE(report->up_to_date);
  EXPECT_EQ(report->manifest.levels.size(), before.size() - 1);
  EXPECT_EQ(fs::last_write_time(out() / "manifest.json"), time);
}

TEST_F(Bake, BakesAnewWhenSourceOptionsOrFilesHaveChanged) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  const auto before = files_of(out());

  ImportedAsset changed = ball_in_leaves();
  changed.source_hash = 78;
  EXPECT_FALSE(bake(std::move(changed), "thing", out(), small_options())->up_to_date);
  EXPECT_FALSE(bake(ball_in_leaves(), "thing", out(), small_options())->up_to_date);
  EXPECT_EQ(files_of(out()), before);

  fs::resize_file(out() / "level_4.ffl", fs::file_size(out() / "level_4.ffl") - 64);
  EXPECT_FALSE(bake(ball_in_leaves(), "thing", out(), small_options())->up_to_date);
  EXPECT_EQ(files_of(out()), before);

  BakeOptions coarser = small_options();
  coarser.finest_grid = 16;
  EXPECT_FALSE(bake(ball_in_leaves(), "thing", out(), coarser)->up_to_date);
  EXPECT_NE(files_of(out()), before);
  EXPECT_FALSE(fs::exists(partial()));
}

/// An OBJ file with a material and a texture that is not there.
void write_source(const fs::path& folder) {
  fs::create_directories(folder);
  std::ofstream(folder / "thing.obj") << "mtllib thing.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.2\nvt 0 0\nusemtl m\n"
                                         "f 1/1 2/1 3/1\nf 2/1 4/1 3/1\n";
  std::ofstream(folder / "thing.mtl") << "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd missing.png\n";
}

TEST_F(Bake, KnowsWithoutAnImportWhetherASourceIsUpToDate) {
  const fs::path source = folder_ / "source" / "thing.obj";
  write_source(source.parent_path());
  EXPECT_FALSE(find_up_to_date(source, out(), small_options()));
  ASSERT_TRUE(bake(source, out(), small_options()));
  const auto manifest = find_up_to_date(source, out(), small_options());
  ASSERT_TRUE(manifest);
  EXPECT_EQ((*manifest->source_files)[0].path, "thing.mtl");
  EXPECT_EQ((*manifest->source_files)[1], (HashedFile{"missing.png", 0}));

  BakeOptions coarser = small_options();
  coarser.finest_grid = 16;
  EXPECT_FALSE(find_up_to_date(source, out(), coarser));

  std::ofstream(source.parent_path() / "missing.png") << "now it is there";
  EXPECT_FALSE(find_up_to_date(source, out(), small_options()));
  fs::remove(source.parent_path() / "missing.png");
  EXPECT_TRUE(find_up_to_date(source, out(), small_options()));

  std::ofstream(source.parent_path() / "thing.mtl", std::ios::app) << "# edited\n";
  EXPECT_FALSE(find_up_to_date(source, out(), small_options()));
  write_source(source.parent_path());
  std::ofstream(source, std::ios::app) << "# edited\n";
  EXPECT_FALSE(find_up_to_date(source, out(), small_options()));
}

TEST_F(Bake, SaysItsWarningsAgainWhenUpToDateAndTheyDoNotNameTheFolder) {
  for (const char* name : {"a", "b"}) {
    const fs::path source = folder_ / name / "thing.obj";
    write_source(source.parent_path());
    const auto first = bake(source, folder_ / name / "out", small_options());
    const auto again = bake(source, folder_ / name / "out", small_options());
    ASSERT_TRUE(first && again);
    EXPECT_TRUE(again->up_to_date);
    EXPECT_EQ(again->warnings, first->warnings);
    ASSERT_FALSE(first->warnings.empty());
    EXPECT_NE(first->warnings[0].find("missing.png"), std::string::npos);
  }
  EXPECT_EQ(files_of(folder_ / "a" / "out"), files_of(folder_ / "b" / "out"));
}

TEST_F(Bake, BakesAnewWhenAFileIsOfAnotherBake) {
  ASSERT_TRUE(bake(two_triangles(), "thing", out(), small_options()).has_value());
  const auto before = files_of(out());
  ASSERT_TRUE(bake(two_triangles(0.1f), "thing", folder_ / "darker", small_options()).has_value());
  fs::copy_file(folder_ / "darker" / "level_0.ffl", out() / "level_0.ffl", fs::copy_options::overwrite_existing);
  ASSERT_EQ(fs::file_size(out() / "level_0.ffl"), before.at("level_0.ffl").size());

  const auto report = bake(two_triangles(), "thing", out(), small_options());
  ASSERT_TRUE(report.has_value());
  EXPECT_FALSE(report->up_to_date);
  EXPECT_EQ(files_of(out()), before);
}

TEST_F(Bake, LeavesTheOldAssetAloneUntilTheNewOneIsComplete) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  const auto before = files_of(out());
  std::atomic<bool> cancel{false};
  BakeOptions options = small_options();
  options.finest_grid = 16;
  options.job.cancel = &cancel;
  options.job.progress = [&](double, const std::string& stage) {
    EXPECT_EQ(files_of(out()), before);
    cancel = cancel || stage == "level 3: write";
  };
  EXPECT_EQ(bake(ball_in_leaves(), "thing", out(), options).error().code, ErrorCode::Cancelled);
  EXPECT_EQ(files_of(out()), before);
}

TEST_F(Bake, OfAGroundPlaneIsJustItsSource) {
  const auto report = bake(two_triangles(), "ground", out(), small_options());
  ASSERT_TRUE(report.has_value()) << report.error().message;
  ASSERT_EQ(report->manifest.levels.size(), 1u);
  EXPECT_EQ(report->manifest.levels[0].triangles, 2u);
  EXPECT_EQ(files_of(out()).size(), 2u);
}

TEST_F(Bake, OfBoardsWithNarrowGapsStaysASurface) {
  const auto report = bake(boards(), "boards.obj", out(), small_options());
  ASSERT_TRUE(report) << report.error().message;
  const auto levels = open_levels(out());
  ASSERT_GT(levels.size(), 1u);
  for (const auto& level : levels) {
    EXPECT_TRUE(level->view().has_surface());
    EXPECT_FALSE(level->view().has_volume());
  }
}

TEST_F(Bake, OfBoardsApartIsASheetWithGaps) {
  const auto levels = bake_all_levels(boards(0.5f), out());
  ASSERT_EQ(levels.size(), 4u);
  for (const size_t grid_16_or_8 : {1u, 2u}) {
    const LevelView& sheet = levels[grid_16_or_8]->view();
    EXPECT_FALSE(sheet.has_volume());
    EXPECT_EQ(sheet.face_sheet_shape.size(), face_count(sheet));
    EXPECT_EQ(sheet.face_gap.size(), face_count(sheet));
  }
  EXPECT_TRUE(levels[3]->view().has_volume());  // so few voxels are no wall
}

TEST_F(Bake, OfBoardsAroundAWallShowsBoth) {
  const auto levels = bake_all_levels(boards_around_a_wall(), out());
  ASSERT_EQ(levels.size(), 4u);
  for (const size_t grid_16_or_8 : {1u, 2u}) {
    const LevelView& wall = levels[grid_16_or_8]->view();
    EXPECT_FALSE(wall.has_volume());
    EXPECT_TRUE(wall.face_sheet_shape.empty());  // a sheet between the boards would be in the wall
    double sum = 0;
    for (const PackedColor& color : wall.face_diffuse) sum += unpack_color(color).x;
    // Boards of 0.5 hide half of the wall and a little more from rays aslant.
    EXPECT_NEAR(sum / static_cast<double>(wall.face_diffuse.size()), 0.27, 0.05);
  }
}

TEST_F(Bake, OfTheSourceOnlyHasNoOtherLevel) {
  BakeOptions options = small_options();
  options.source_only = true;
  const auto report = bake(ball_in_leaves(), "thing", out(), options);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->manifest.levels.size(), 1u);
}

TEST_F(Bake, LeavesOutLevelsThatSaveNothing) {
  BakeOptions options = small_options();
  int call = 0;
  options.measure_resident = [&](const LevelView&) {  // levels 0 to 4
    const uint64_t megabytes[] = {1000, 950, 500, 460, 455};
    return Result<LevelCost>(LevelCost{megabytes[call++] << 20, 1});
  };
  const auto report = bake(ball_in_leaves(), "thing", out(), options);
  ASSERT_TRUE(report.has_value());
  std::vector<uint32_t> stored;
  for (const LevelEntry& entry : report->manifest.levels) stored.push_back(entry.level);
  EXPECT_EQ(stored, (std::vector<uint32_t>{0, 2, 4}));
  EXPECT_EQ(report->levels.size(), 5u);
  const auto levels = open_levels(out());
  EXPECT_EQ(levels[1]->view().morph_face.size(), face_count(levels[0]->view()));  // from level 0, not level 1
  EXPECT_EQ(levels[2]->view().morph_face.size(), face_count(levels[1]->view()));
}

TEST_F(Bake, DoesNotVoxeliseWhatCannotSaveAnything) {
  BakeOptions options = small_options();
  options.finest_grid = 128;
  options.measure_resident = [](const LevelView& level) {
    return Result<LevelCost>(LevelCost{level.header.level == 0 ? 100000u : 1000u >> level.header.level, 1});
  };
  test::LeafCloud specks;  // all smaller than a voxel, in most of some 5000 bricks
  specks.leaf_size = 0.006f;
  const auto report = bake(test::asset_of(test::leaf_cloud(specks)), "specks", out(), options);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->levels[1].voxelized_triangles, 8000u);
  EXPECT_TRUE(report->levels[1].worthless);
  EXPECT_FALSE(report->levels[1].is_written);
  EXPECT_FALSE(report->levels.back().worthless);
  EXPECT_TRUE(report->levels.back().is_written);
  open_levels(out());
}

/// A square with a texture of `side`^2 texels that varies everywhere.
ImportedAsset textured_square(int side) {
  std::vector<vec4> texels;
  for (int i = 0; i < side * side; ++i) texels.emplace_back(vec3(static_cast<float>(mix64(i) % 1000) / 1000), 1);
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].name = "noise";
  mesh.materials[0].base_color_map.image = std::make_shared<const Texture>(side, side, texels);
  return std::move(*condition(std::move(mesh), "square"));
}

TEST_F(Bake, KeepsTexturesAndStoresNoLevelThatTakesMoreThanThey) {
  const auto report = bake(textured_square(64), "square", out(), small_options());
  ASSERT_TRUE(report.has_value()) << report.error().message;
  ASSERT_EQ(report->manifest.textures.size(), 1u);
  EXPECT_EQ(report->manifest.materials.at(0).name, "noise");
  EXPECT_EQ(report->manifest.materials[0].base_color_map.texture, 0u);
  EXPECT_TRUE(fs::exists(out() / "texture_0.tif"));
  uint64_t least = report->manifest.levels[0].resident_bytes + report->manifest.textures[0].cache_bytes;
  for (size_t i = 1; i < report->manifest.levels.size(); ++i) {
    EXPECT_LT(report->manifest.levels[i].resident_bytes, least);
    least = report->manifest.levels[i].resident_bytes;
  }
  EXPECT_TRUE(bake(textured_square(64), "square", out(), small_options())->up_to_date);
  const auto before = files_of(out());
  std::ofstream(out() / "texture_0.tif", std::ios::app) << "x";
  EXPECT_FALSE(bake(textured_square(64), "square", out(), small_options())->up_to_date);
  EXPECT_EQ(files_of(out()), before);
}

TEST_F(Bake, LinksTexturesThatAnotherAssetHas) {
  const auto first = bake(textured_square(64), "square", folder_ / "first.farfield", small_options());
  ASSERT_TRUE(first.has_value());
  const fs::path texture = folder_ / "first.farfield" / "texture_0.tif";
  BakeOptions options = small_options();
  options.known_textures = {{first->manifest.textures[0].file_hash, texture}};
  ASSERT_TRUE(bake(textured_square(64), "square", out(), options).has_value());
  EXPECT_TRUE(fs::equivalent(texture, out() / "texture_0.tif"));
  EXPECT_EQ(files_of(out()), files_of(folder_ / "first.farfield"));

  // What is not what it is said to be, or is not there any more, is not linked to.
  for (const char* other : {"other.tif", "gone.tif"}) {
    if (std::string(other) == "other.tif") test::write_text(folder_ / other, "something else");
    options.known_textures = {{first->manifest.textures[0].file_hash, folder_ / other}};
    options.even_if_up_to_date = true;
    ASSERT_TRUE(bake(textured_square(64), "square", out(), options).has_value());
    EXPECT_EQ(files_of(out()), files_of(folder_ / "first.farfield"));
    EXPECT_FALSE(fs::equivalent(texture, out() / "texture_0.tif"));
  }
}

/// The edges at the border of a surface, by their ends.
std::set<std::array<float, 6>> border_of(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
  const EdgeTable edges = build_edge_table(triangles, positions.size());
  std::set<std::array<float, 6>> border;
  for (uint32_t e = 0; e < edges.size(); ++e) {
    if (edges.faces_of(e).size() != 1) continue;
    vec3 a = positions[edges.smaller_vertex[e]], b = positions[edges.larger_vertex[e]];
    if (std::tie(a.x, a.y, a.z) > std::tie(b.x, b.y, b.z)) std::swap(a, b);
    border.insert({a.x, a.y, a.z, b.x, b.y, b.z});
  }
  return border;
}

TEST_F(Bake, TilesKeepTheirCutsInAllLevels) {
  const Surface hills = test::make_grid(
      48, 48, false, [](float u, float v) { return vec3(u, 0.03f * std::sin(15 * u) * std::cos(13 * v), v); });
  const auto rim = border_of(hills.positions, hills.triangles);
  for (const uint32_t number : {0u, 3u}) {
    ImportedAsset tile = test::asset_of(hills);
    tile.source = cut_tile(tile.source, {number, 4});
    std::set<std::array<float, 6>> cut = border_of(tile.source.positions, tile.source.triangles);
    for (const auto& edge : rim) cut.erase(edge);
    ASSERT_GE(cut.size(), 48u);
    BakeOptions options = small_options();
    options.import.tile = {number, 4};
    options.surfaces_only = true;
    size_t faces = tile.source.triangles.size(), levels = 0;
    options.see_surfaces = [&](const LevelSurfaces& level) -> Result<void> {
      const auto border = border_of(level.simplified.positions, level.simplified.triangles);
      EXPECT_TRUE(std::ranges::includes(border, cut)) << "level " << level.level;
      EXPECT_EQ(level.sub_resolution.triangles.size(), 0u) << "borders are not eaten, level " << level.level;
      EXPECT_LE(level.simplified.triangles.size(), faces);
      faces = level.simplified.triangles.size();
      ++levels;
      return {};
    };
    const auto report = bake(std::move(tile), "hills", folder_ / fmt::format("{}", number), options);
    ASSERT_TRUE(report.has_value()) << report.error().message;
    EXPECT_EQ(levels, 4u);
    EXPECT_LT(faces, 4 * cut.size()) << "inside, levels are as coarse as ever";
  }
}

TEST_F(Bake, RefusesSenselessOptions) {
  const auto code = [&](const BakeOptions& options) {
    const auto report = bake(two_triangles(), "x", out(), options);
    return report ? "none" : report.error().code == ErrorCode::InvalidArgument ? "invalid" : "other";
  };
  for (const auto& [finest, coarsest] :
       {std::pair{0u, 8u}, {100u, 8u}, {8u, 16u}, {64u, 0u}, {64u, 12u}, {1u << 20, 8u}}) {
    BakeOptions options = small_options();
    options.finest_grid = finest, options.coarsest_grid = coarsest;
    EXPECT_STREQ(code(options), "invalid") << finest << " " << coarsest;
  }
  BakeOptions options = small_options();
  options.rays_per_voxel = 0;
  EXPECT_STREQ(code(options), "invalid");
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Bake, MeasuresLevelsAsTheRuntimeLoadsThemUnlessToldOtherwise) {
  BakeOptions options = small_options();
  options.measure_resident = nullptr;
  const auto report = bake(two_triangles(), "x", out(), options);
  ASSERT_TRUE(report) << report.error().message;
  for (const LevelEntry& entry : report->manifest.levels) {
    const auto file = LevelFile::open(out() / entry.file, LevelCheck::Full);
    ASSERT_TRUE(file) << file.error().message;
    const auto cost = measure_level_scene((*file)->view());
    ASSERT_TRUE(cost) << cost.error().message;
    EXPECT_EQ(entry.resident_bytes, cost->resident_bytes) << entry.level;
    EXPECT_EQ(entry.build_peak_bytes, cost->build_peak_bytes) << entry.level;
    EXPECT_EQ(entry.ray_cost, ray_cost((*file)->view())) << entry.level;
  }
}

TEST_F(Bake, VerifyFindsAManifestThatLiesAboutMorphs) {
  BakeOptions options = small_options();
  options.measure_resident = nullptr;
  const auto report = bake(ball_in_leaves(), "thing", out(), options);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(verify_and_measure_asset(out()).findings.empty());
  Manifest manifest = report->manifest;
  ASSERT_GE(manifest.levels.size(), 2u);
  LevelEntry& coarser = manifest.levels[1];
  ASSERT_TRUE(coarser.morph);
  const uint64_t truth = coarser.morph->resident_bytes + coarser.morph->build_peak_bytes;
  coarser.morph = LevelCost{truth / 4, truth / 4};
  ASSERT_TRUE(write_manifest(out(), manifest));
  const VerifyResult result = verify_and_measure_asset(out());
  EXPECT_FALSE(result.is_sound());
  ASSERT_EQ(result.findings.size(), 1u);
  EXPECT_EQ(result.findings[0].file, coarser.file);
  EXPECT_NE(result.findings[0].message.find("its morph from the next finer level takes"), std::string::npos)
      << result.findings[0].message;
}

TEST_F(Bake, NeverReplacesWhatIsNotABakedAsset) {
  fs::create_directories(out());
  std::ofstream(out() / "thesis.tex") << "years of work";
  auto report = bake(two_triangles(), "x", out(), small_options());
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
  EXPECT_TRUE(fs::exists(out() / "thesis.tex"));
  fs::remove_all(out());
  std::ofstream(out().string()) << "a file";
  report = bake(two_triangles(), "x", out(), small_options());
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
  fs::remove(out());
  fs::create_directories(out());  // an empty folder is fine
  EXPECT_TRUE(bake(two_triangles(), "x", out(), small_options()).has_value());
}

/// Expects that a bake refuses to replace out(), names `stranger`, and leaves all as it is.
void expect_refused(const fs::path& out, const std::string& stranger) {
  const auto before = files_of(out);
  const auto report = bake(two_triangles(), "x", out, small_options());
  ASSERT_FALSE(report.has_value()) << stranger;
  EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(report.error().message.find(out.string()), std::string::npos) << report.error().message;
  EXPECT_NE(report.error().message.find(stranger), std::string::npos) << report.error().message;
  EXPECT_EQ(files_of(out), before);
  EXPECT_FALSE(fs::exists(out.string() + ".partial"));
}

TEST_F(Bake, NeverReplacesAFolderWithSomebodyElsesManifest) {
  fs::create_directories(out());
  for (const char* text : {R"({"name": "a web app", "start_url": "/"})", R"({"version": 1, "generator": "vite"})",
                           R"({"version": 1, "generator": 7})", "[]", "no JSON", ""}) {
    test::write_text(out() / "manifest.json", text);
    expect_refused(out(), "manifest.json is not Farfield's");
  }
  test::write_text(out() / "index.html", "<html>");
  expect_refused(out(), "index.html");
}

TEST_F(Bake, NeverReplacesAnAssetWithOtherFilesInIt) {
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  for (const char* name : {"notes.txt", "level_1.ffl.bak", "level_.ffl", "manifest.json.tmp", ".hidden"}) {
    test::write_text(out() / name, "mine");
    expect_refused(out(), name);
    fs::remove(out() / name);
  }
  fs::create_directory(out() / "level_9.ffl");
  expect_refused(out(), "level_9.ffl");
  fs::remove(out() / "level_9.ffl");
  fs::create_symlink(folder_, out() / "level_9.ffl");
  expect_refused(out(), "level_9.ffl");
}

TEST_F(Bake, AFileThatDoesNotBelongDoesNoHarmWhileTheAssetIsUpToDate) {
  ASSERT_TRUE(bake(two_triangles(), "x", out(), small_options()).has_value());
  test::write_text(out() / "notes.txt", "mine");
  const auto report = bake(two_triangles(), "x", out(), small_options());
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_TRUE(report->up_to_date);
}

TEST_F(Bake, RefusesWhatIsNoAssetBeforeItReadsTheSource) {
  fs::create_directories(out());
  test::write_text(out() / "thesis.tex", "years of work");
  const auto report = bake(folder_ / "missing.obj", out(), small_options());
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
}

TEST_F(Bake, KeepsAFileThatWasPutIntoTheOldAssetMeanwhile) {
  ASSERT_TRUE(bake(two_triangles(), "x", out(), small_options()).has_value());
  BakeOptions options = small_options();
  options.job.progress = [&](double, const std::string& stage) {
    if (stage == "level 4: write") test::write_text(out() / "notes.txt", "mine");
  };
  const auto report = bake(ball_in_leaves(), "thing", out(), options);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
  EXPECT_TRUE(fs::exists(out() / "notes.txt"));
  EXPECT_EQ(read_manifest(out())->source, "x");
}

TEST_F(Bake, ReplacesDamagedAndNewerAssetsAndWhatKilledWritersLeft) {
  ASSERT_TRUE(bake(two_triangles(), "x", out(), small_options()).has_value());
  const auto whole = files_of(out());
  const std::string manifest = whole.at("manifest.json");
  for (const std::string& damaged :
       {std::string(), manifest.substr(0, 100), std::string(500, '\0'),
        std::string(R"({"version": 99, "generator": "farfield 9.0.0", "levels": "elsewhere"})")}) {
    test::write_text(out() / "manifest.json", damaged);
    test::write_text(out() / "manifest.json.tmp-17-3", "half");
    test::write_text(out() / "level_0.ffl.tmp-17-2", "half");
    const auto report = bake(two_triangles(), "x", out(), small_options());
    ASSERT_TRUE(report.has_value()) << report.error().message;
    EXPECT_EQ(files_of(out()), whole);
  }
}

TEST_F(Bake, FailsClearlyWhereItCannotWrite) {
  std::ofstream(folder_ / "file") << "not a folder";
  const auto report = bake(two_triangles(), "x", folder_ / "file" / "asset.farfield", small_options());
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::Io);
  EXPECT_NE(report.error().message.find("asset.farfield"), std::string::npos);
  EXPECT_EQ(files_of(folder_).size(), 1u);
}

TEST_F(Bake, LeavesNothingHalfWrittenWhenTheDiskIsFull) {
  // A limit on file size fails writes as a full disk does, at every possible level.
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", folder_ / "whole", small_options()).has_value());
  const auto whole = files_of(folder_ / "whole");
  struct rlimit before {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const auto& [name, content] : whole) {
    struct rlimit limit = before;
    limit.rlim_cur = content.size() - 1;
    setrlimit(RLIMIT_FSIZE, &limit);
    const auto report = bake(ball_in_leaves(), "thing", out(), small_options());
    setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(report.has_value()) << name;
    EXPECT_EQ(report.error().code, ErrorCode::Io);
    EXPECT_FALSE(fs::exists(out()));
    EXPECT_FALSE(fs::exists(partial() / "asset"));
  }
  std::signal(SIGXFSZ, handler);
  ASSERT_TRUE(bake(ball_in_leaves(), "thing", out(), small_options()).has_value());
  EXPECT_EQ(files_of(out()), whole);
}

TEST_F(Bake, PassesOnWhatTheMeasureSays) {
  BakeOptions options = small_options();
  options.measure_resident = [](const LevelView&) -> Result<LevelCost> {
    return make_error(ErrorCode::Io, "no Embree today");
  };
  const auto report = bake(two_triangles(), "x", out(), options);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().message, "no Embree today");
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Bake, WorkspaceHasOneHolderAtATimeWhileOthersComeAndGo) {
  std::atomic<int> holders{0}, taken{0};
  const auto come_and_go = [&] {
    for (int i = 0; i < 200; ++i) {
      auto workspace = BakeWorkspace::open(out());
      ASSERT_TRUE(workspace) << workspace.error().message;
      ++taken;
      ASSERT_EQ(++holders, 1);
      ASSERT_TRUE(fs::is_directory(workspace->asset_dir()));
      --holders;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back(come_and_go);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(taken, 4 * 200);
  EXPECT_FALSE(fs::exists(partial()));
}

TEST_F(Bake, ASecondBakeOfTheSameAssetWaitsAndFindsItDone) {
  std::thread second;
  Result<BakeReport> found = BakeReport();
  BakeOptions options = small_options();
  options.job.progress = [&](double, const std::string& stage) {
    if (stage != "level 1: analyse" || second.joinable()) return;
    second = std::thread([&] { found = bake(ball_in_leaves(), "thing", out(), small_options()); });
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // or it comes too late to wait, which is as well
  };
  const auto first = bake(ball_in_leaves(), "thing", out(), options);
  ASSERT_TRUE(second.joinable());
  second.join();
  ASSERT_TRUE(first.has_value());
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_TRUE(found->up_to_date);
  EXPECT_EQ(found->manifest.source_hash, first->manifest.source_hash);
}

TEST_F(Bake, WhoWaitsSaysForWhomAndEndsWhenAsked) {
  const auto holder = BakeWorkspace::open(out());
  ASSERT_TRUE(holder.has_value());
  std::atomic<bool> cancel{false};
  std::string stage_seen;
  BakeOptions options = small_options();
  options.job.cancel = &cancel;
  options.job.progress = [&](double, const std::string& stage) {
    stage_seen = stage;
    cancel = true;
  };
  const auto waiting = bake(two_triangles(), "x", out(), options);
  ASSERT_FALSE(waiting.has_value());
  EXPECT_EQ(waiting.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(stage_seen.find(fmt::format("wait for process {} on ", ::getpid())), 0u) << stage_seen;
}

TEST_F(Bake, WhatADeadBakeLeftHoldsNobodyUp) {
  fs::create_directories(partial() / "asset");
  std::ofstream(partial() / "owner") << "process 1 on nowhere";
  const auto baked = bake(two_triangles(), "x", out(), small_options());
  ASSERT_TRUE(baked.has_value()) << baked.error().message;
  EXPECT_FALSE(fs::exists(partial()));
}

}  // namespace
}  // namespace farfield
