// SPDX-License-Identifier: Apache-2.0
// Every file of tests/data/nasty, as its expect.json says: "yes" has to load with finite data, "refuse" has to be
// refused with a message that names the file, "either" may do one or the other.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "import/gltf_scene.h"
#include "prefilter/condition.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/imported_surface.h"

namespace farfield {
namespace {

using namespace test;

namespace fs = std::filesystem;

const fs::path kNasty = fs::path(FARFIELD_TEST_DATA) / "nasty";

nlohmann::json expectations() { return nlohmann::json::parse(std::ifstream(kNasty / "expect.json")); }

std::vector<std::string> names() {
  std::vector<std::string> out;
  const nlohmann::json all = expectations();
  for (const auto& [name, expected] : all.items()) out.push_back(name);
  return out;
}

/// Files too large to be stored here, made as scripts/make_nasty.py of the shared assets makes them.
fs::path find_or_make(const std::string& name, const TemporaryFolder& folder) {
  if (fs::exists(kNasty / name)) return kNasty / name;
  if (name == "deep_hierarchy_5000.glb") {
    std::string nodes = R"({"mesh":0,"children":[1]},)";
    for (int i = 1; i < 4999; ++i) nodes += fmt::format(R"({{"translation":[0,0,0.01],"children":[{}]}},)", i + 1);
    const std::string json = fmt::format(
        R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{}{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36}}]}})",
        nodes);
    return folder.write(name, glb(json, raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0})));
  }
  if (name == "materials_2000.obj") {
    std::string obj = "mtllib materials_2000.mtl\n", mtl;
    for (int i = 0; i <= 2000; ++i) obj += fmt::format("v {0} 0 0\nv {0} 1 0\n", i);
    for (int i = 0; i < 2000; ++i) {
      obj += fmt::format("usemtl m{}\nf {} {} {} {}\n", i, 2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2);
      mtl += fmt::format("newmtl m{}\nKd {} 0.5 0.5\n", i, i / 2000.0);
    }
    folder.write("materials_2000.mtl", mtl);
    return folder.write(name, obj);
  }
  return kNasty / name;
}

void expect_usable(const Surface& surface) {
  ASSERT_FALSE(surface.triangles.empty());
  ASSERT_EQ(surface.triangles.size(), surface.materials.size());
  for (const vec3& p : surface.positions) ASSERT_TRUE(is_finite(p));
  ASSERT_TRUE(std::isfinite(surface.origin.x + surface.origin.y + surface.origin.z));
  for (size_t i = 0; i < surface.triangles.size(); ++i) {
    const uvec3& t = surface.triangles[i];
    for (int k = 0; k < 3; ++k) ASSERT_LT(t[k], surface.positions.size());
    ASSERT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
    const FaceMaterial& m = surface.materials[i];
    ASSERT_NEAR(m.sggx.trace(), 1, 1e-5);  // n n^T of a unit normal
    for (int c = 0; c < 3; ++c) {
      ASSERT_GE(std::min({m.diffuse[c], m.specular[c], m.transmission[c]}), 0.0f);
      ASSERT_LE(m.diffuse[c] + m.specular[c] + m.transmission[c], 1.0f + 1e-6f);
    }
    ASSERT_GE(m.roughness2, 0.0f);
    ASSERT_LE(m.roughness2, 1.0f);
  }
}

class NastyFile : public ::testing::TestWithParam<std::string> {};

TEST_P(NastyFile, LoadsOrIsRefusedAsExpected) {
  const TemporaryFolder folder;
  const std::string name = GetParam();
  const std::string load = expectations()[name]["load"];
  const fs::path file = find_or_make(name, folder);
  ASSERT_TRUE(fs::exists(file)) << file;
  const auto asset = test::import_surface(file);
  if (asset) {
    EXPECT_NE(load, "refuse");
    expect_usable(asset->surface);
  } else {
    EXPECT_NE(load, "yes") << asset.error().message;
    EXPECT_NE(asset.error().message.find(name), std::string::npos) << asset.error().message;
    EXPECT_EQ(asset.error().message.find('\n'), std::string::npos) << asset.error().message;
  }
  if (file.extension() == ".glb") read_gltf_scene(file);  // must not crash either
}

std::string test_name(const ::testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(All, NastyFile, ::testing::ValuesIn(names()), test_name);

// ---- what exactly comes out of those that load

Result<test::ImportedSurface> import_nasty(const std::string& name) { return test::import_surface(kNasty / name); }

double area(const Surface& surface) {
  double sum = 0;
  for (const uvec3& t : surface.triangles) {
    const dvec3 a(surface.positions[t.x]), b(surface.positions[t.y]), c(surface.positions[t.z]);
    sum += 0.5 * glm::length(glm::cross(b - a, c - a));
  }
  return sum;
}

TEST(NastyFiles, SplitVerticesOfASphereAreWeldedAlsoWithJitter) {
  for (const char* name : {"duplicate_vertices_soup.obj", "near_duplicate_vertices.obj"}) {
    const auto asset = import_nasty(name);
    ASSERT_TRUE(asset) << asset.error().message;
    EXPECT_EQ(asset->surface.positions.size(), 266u) << name;
    EXPECT_EQ(asset->surface.triangles.size(), 528u) << name;
  }
}

TEST(NastyFiles, ConcaveStarIsFilledExactly) {
  const auto asset = import_nasty("ngon_concave_60.obj");
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(asset->surface.triangles.size(), 58u);
  // 60 triangles from the centre with sides 1 and 1.3 and an angle of 6 degrees
  EXPECT_NEAR(area(asset->surface), 60 * 0.5 * 1.3 * std::sin(glm::radians(6.0)), 1e-4);
}

TEST(NastyFiles, ConcaveQuadIsCutAlongItsInnerDiagonal) {
  const auto asset = import_nasty("quad_nonplanar_concave.obj");
  ASSERT_TRUE(asset) << asset.error().message;
  double arrow = 0;
  for (const uvec3& t : asset->surface.triangles) {
    const vec3 &a = asset->surface.positions[t.x], &b = asset->surface.positions[t.y],
               &c = asset->surface.positions[t.z];
    if (a.x >= 3) arrow += 0.5 * glm::length(glm::cross(b - a, c - a));
  }
  EXPECT_NEAR(arrow, 0.2, 1e-6);  // the outer diagonal would give more
}

TEST(NastyFiles, FarSphereKeepsItsShapeRelativeToAnOriginOfItsOwn) {
  const auto asset = import_nasty("huge_offset_1e7.obj");
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_LT(glm::length(asset->surface.origin - dvec3(1e7)), 1e-3);
  EXPECT_EQ(asset->surface.triangles.size(), 528u);
  for (const vec3& p : asset->surface.positions) ASSERT_NEAR(glm::length(p), 1, 1e-4);
}

TEST(NastyFiles, SmallestSphereSurvivesBesideOneAHundredMillionTimesLarger) {
  const auto asset = import_nasty("scale_range_1e8.obj");
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(asset->surface.positions.size(), 798u);
  EXPECT_EQ(asset->surface.triangles.size(), 3 * 528u);
}

TEST(NastyFiles, CoincidentLayersBecomeOne) {
  const auto asset = import_nasty("duplicate_faces.obj");
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(asset->surface.triangles.size(), 2 * 64u);
  EXPECT_FALSE(asset->warnings.empty());
}

TEST(NastyFiles, SparseAccessorReplacesItsVertex) {
  const auto asset = import_nasty("sparse_accessor.glb");
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(asset->surface.triangles.size(), 1u);  // with vertex 1 at (1, 1, 0) the other one has no area
  EXPECT_NEAR(area(asset->surface), 0.5, 1e-6);
}

TEST(NastyFiles, UnknownRequiredExtensionIsNamed) {
  const auto asset = import_nasty("required_unknown_extension.glb");
  ASSERT_FALSE(asset);
  EXPECT_EQ(asset.error().code, ErrorCode::Unsupported);
  EXPECT_NE(asset.error().message.find("VENDOR_unknown"), std::string::npos) << asset.error().message;
}

}  // namespace
}  // namespace farfield
