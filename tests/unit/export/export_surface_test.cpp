// SPDX-License-Identifier: Apache-2.0
// Surfaces on the way out and back: our own readers, and a bake's view of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>

#include "base/random.h"
#include "cache/level_values.h"
#include "evaluate/source_summary.h"
#include "export/export_asset.h"
#include "export/face_looks.h"
#include "tests/support/asset_writer.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;

/// What of a level's light a format keeps.
struct Kept {
  bool highlights = true, transmission = true, opacity = true;
};

/// Sums over a surface: faces, area, and means of what is there, weighted as source_summary.h has it.
struct Figures {
  uint64_t faces = 0;
  double area = 0;
  dvec3 albedo{0.0}, transmission{0.0}, emission{0.0};
};

Figures figures_of(const LevelView& level, const Kept& kept) {
  Figures out;
  double seen = 0;
  const auto corners = face_corners(level);
  const auto looks = face_looks(level, corners);
  for (const FaceLook& look : looks) {
    const double weight = look.area * (kept.opacity ? double{look.opacity} : 1.0);
    const vec3 specular = kept.highlights ? look.specular : vec3(0.0f);
    out.albedo += weight * dvec3(specular + (1.0f - specular) * look.diffuse);
    if (kept.transmission) out.transmission += weight * dvec3(look.transmission);
    if (kept.highlights) out.emission += weight * dvec3(look.emission);
    out.area += look.area;
    seen += weight;
  }
  out.faces = looks.size();
  out.albedo /= seen, out.transmission /= seen, out.emission /= seen;
  return out;
}

Figures figures_of(const SourceSummary& summary) {
  Figures out;
  double seen = 0;
  for (const MaterialSummary& m : summary.materials) {
    const double weight = m.area_share * double{m.opacity};
    out.albedo += weight * dvec3(m.albedo);
    out.transmission += weight * dvec3(m.transmission);
    out.emission += weight * dvec3(m.emission);
    seen += weight;
  }
  out.faces = summary.triangles;
  out.area = summary.area;
  out.albedo /= seen, out.transmission /= seen, out.emission /= seen;
  return out;
}

void expect_near(const dvec3& a, const dvec3& b, double tolerance, const std::string& what) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance * b[c]) << what << " " << c;
}

/// A sphere with a look of its own on each face: leaves, metal, glass.
LevelData colorful_sphere() {
  LevelData level = test::sphere_level({0.5f, 0, 0}, 1.0f, 16, 3, 0.1f);
  Rng rng(7);
  for (uint32_t f = 0; f < face_count(level); ++f) {
    const bool is_leaf = rng.next() < 0.5f, is_metal = !is_leaf && rng.next() < 0.3f;
    const vec3 color = 0.45f * vec3(rng.next(), rng.next(), rng.next());
    level.face_diffuse.push_back(pack_color(is_metal ? vec3(0.0f) : color));
    level.face_specular.push_back(pack_color(is_metal ? vec3(0.9f, 0.6f, 0.3f) : vec3(is_leaf ? 0.03f : 0.0f)));
    level.face_roughness2.push_back(pack_unorm8(rng.next()));
    level.face_transmission.push_back(pack_color(is_leaf ? vec3(0.1f, 0.3f, 0.05f) : vec3(0.0f)));
    level.face_opacity.push_back(is_leaf ? pack_unorm8(0.5f + 0.5f * rng.next()) : uint8_t{255});
    level.face_gap.push_back(rng.next() < 0.2f ? pack_unorm8(0.3f) : uint8_t{0});
    level.face_emission.push_back(pack_radiance(rng.next() < 0.1f ? vec3(20, 10, 5) : vec3(0.0f)));
  }
  return level;
}

class ExportSurface : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  fs::path asset_of(const LevelData& level, const dvec3& origin = dvec3(0.0)) const {
    const fs::path asset = path("a.farfield");
    test::write_asset(
        asset, {level},
        [](const LevelView&) {
          return LevelCost{1 << 20, 100};
        },
        origin);
    return asset;
  }
  SourceSummary export_and_import(const fs::path& asset, const std::string& name, uint32_t level = 3) {
    const auto report = export_asset(asset, path(name), {{level}});
    EXPECT_TRUE(report) << report.error().message;
    if (report) report_ = *report;
    const auto summary = summarise_source(path(name));
    EXPECT_TRUE(summary) << summary.error().message;
    return summary.value_or(SourceSummary());
  }
  bool is_said(const std::string& words) const {
    return std::ranges::any_of(report_.notes, [&](const std::string& n) { return n.find(words) != std::string::npos; });
  }

  const test::TemporaryFolder folder_;
  ExportReport report_;
};

TEST_F(ExportSurface, HasTheSameFacesAreaAndLightForOurOwnReaders) {
  const LevelData level = colorful_sphere();
  const dvec3 origin(1000, -20, 3);
  const fs::path asset = asset_of(level, origin);
  const std::map<std::string, Kept> formats = {
      {"a.glb", {}}, {"a.obj", {.transmission = false}}, {"a.ply", {false, false, false}}};
  for (const auto& [name, kept] : formats) {
    const SourceSummary summary = export_and_import(asset, name);
    const Figures found = figures_of(summary), expected = figures_of(view_of(level), kept);
    EXPECT_EQ(found.faces, expected.faces) << name;
    EXPECT_EQ(report_.levels[0].faces, expected.faces) << name;
    EXPECT_NEAR(found.area, expected.area, 1e-4 * expected.area) << name;
    expect_near(found.albedo, expected.albedo, 0.005, name);
    expect_near(found.transmission, expected.transmission, 0.005, name);
    expect_near(found.emission, expected.emission, 0.01, name);
    const Box3& bounds = level.header.bounds;
    EXPECT_LT(glm::distance(summary.lower, origin + dvec3(bounds.lower)), 1e-3) << name;
    EXPECT_LT(glm::distance(summary.upper, origin + dvec3(bounds.upper)), 1e-3) << name;
  }
  EXPECT_TRUE(fs::exists(path("a.mtl")));
}

TEST_F(ExportSurface, KeepsVerticesThatFacesShareAndPositionsToTheLastBit) {
  LevelData level = test::sphere_level({0, 0, 0}, 1.0f, 16, 3, 0.1f);
  test::set_diffuse(level, {0.2f, 0.4f, 0.6f});
  const fs::path asset = asset_of(level);
  for (const char* name : {"a.glb", "a.obj", "a.ply"}) {
    const SourceSummary summary = export_and_import(asset, name);
    EXPECT_EQ(report_.levels[0].vertices, level.positions.size()) << name;
    EXPECT_EQ(summary.vertices, level.positions.size()) << name;
    EXPECT_EQ(vec3(summary.upper), level.header.bounds.upper) << name;
    EXPECT_EQ(summary.materials.size(), 1u) << name;
    expect_near(dvec3(summary.materials[0].albedo), dvec3(unpack_color(level.face_diffuse[0])), 0.01, name);
    EXPECT_TRUE(report_.notes.empty()) << name;
  }
}

TEST_F(ExportSurface, SaysWhatTheFormatCannotHold) {
  const fs::path asset = asset_of(test::full_level_of_version_5());
  for (const char* name : {"a.glb", "a.obj", "a.ply"}) {
    export_and_import(asset, name);
    EXPECT_TRUE(is_said("level 3: volumes are left out; a .vdb has them")) << name;
    EXPECT_TRUE(is_said("textures are left out")) << name;
    EXPECT_EQ(is_said("transmission"), name == std::string("a.obj")) << name;
    EXPECT_EQ(is_said("smooth normals are left out"), name == std::string("a.ply")) << name;
  }
  ASSERT_TRUE(export_asset(asset, path("a.vdb"), {{3}}));
  report_ = *export_asset(asset, path("a.vdb"), {{3}});
  EXPECT_TRUE(is_said("level 3: surfaces are left out; .ply, .obj and .glb have them"));
}

TEST_F(ExportSurface, PlyHasEverythingThatAFaceHas) {
  export_and_import(asset_of(test::full_level_of_version_5()), "a.ply");
  const auto bytes = test::read_bytes(path("a.ply"));
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const char* name :
       {"specular_red", "roughness", "transmission_blue", "emission_green", "opacity", "gap", "sggx_yz"})
    EXPECT_NE(text.find(fmt::format("property float {}\n", name)), std::string::npos) << name;
  const size_t header = text.find("end_header\n") + 11;
  const size_t face = 1 + 12 + 3 + 4 * (3 + 1 + 3 + 3 + 1 + 1 + 6);
  EXPECT_EQ(bytes.size(), header + 4 * 12 + 3 * face);
}

TEST_F(ExportSurface, TheSameAssetGivesTheSameBytes) {
  const fs::path asset = asset_of(colorful_sphere());
  for (const std::string ending : {".glb", ".obj", ".ply"}) {
    ASSERT_TRUE(export_asset(asset, path("a" + ending), {{3}}));
    const auto first = test::read_bytes(path("a" + ending));
    ASSERT_TRUE(export_asset(asset, path("a" + ending), {{3}}));
    EXPECT_EQ(first, test::read_bytes(path("a" + ending))) << ending;
  }
}

}  // namespace
}  // namespace farfield
