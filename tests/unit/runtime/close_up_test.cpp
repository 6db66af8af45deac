// SPDX-License-Identifier: Apache-2.0
// Level 0 up close, from a mesh in memory to hits: textures, normals, masks, hosts' materials, the budget.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "bake/bake.h"
#include "tests/support/files.h"
#include "tests/support/images.h"
#include "tests/support/runtime_host.h"
#include "tests/support/source_surfaces.h"

namespace farfield {
namespace {

using test::image;

namespace fs = std::filesystem;

class CloseUp : public ::testing::Test {
 protected:
  /// Bakes level 0 alone and opens it in a host, ready to be traced.
  void show(SourceMesh mesh, MaterialFunction at_render = {}, uint64_t budget = uint64_t{1} << 30) {
    auto asset = condition(std::move(mesh), "square");
    ASSERT_TRUE(asset) << asset.error().message;
    BakeOptions options;
    options.source_only = true;
    const auto baked = bake(std::move(*asset), "square", out(), options);
    ASSERT_TRUE(baked) << baked.error().message;
    open(std::move(at_render), budget);
  }

  void open(MaterialFunction at_render = {}, uint64_t budget = uint64_t{1} << 30) {
    RuntimeOptions options;
    options.budget_bytes = budget;
    host_ = std::make_unique<test::Host>(options);
    const auto id = host_->runtime().open_asset(out().string(), std::move(at_render));
    ASSERT_TRUE(id) << id.error().message;
    ASSERT_TRUE(host_->runtime().add_instance(*id, mat4x3(1.0f)));
    host_->plan();
  }

  /// What a ray from above sees at (x, y); kind None: it passes.
  Interaction look(float x, float y, float cone_width = 0, uint32_t ray_seed = 1) {
    RayContext context;
    context.cone_width = cone_width;
    context.ray_seed = ray_seed;
    EmbreeRayHit hit;
    if (!host_->trace({x, y, 3}, {0, 0, -1}, context, hit)) return {};
    return host_->interaction(hit, context);
  }

  fs::path out() const { return folder_.path() / "square.farfield"; }

  const test::TemporaryFolder folder_;
  std::unique_ptr<test::Host> host_;
};

void expect_near(const vec3& a, const vec3& b, float tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << c;
}

TEST_F(CloseUp, ShowsTexelsWhereTheyAre) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].name = "tiles";
  mesh.materials[0].base_color_map.image =
      image(4, [](int x, int y) { return vec4(x == 1 ? 0.8f : 0.1f, y == 2 ? 0.6f : 0.2f, 0.25f, 1); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      const vec2 at((static_cast<float>(x) + 0.5f) / 4, (static_cast<float>(y) + 0.5f) / 4);
      const Interaction seen = look(at.x, at.y);
      ASSERT_EQ(seen.kind, Interaction::Kind::Surface);
      expect_near(seen.albedo, {x == 1 ? 0.8f : 0.1f, y == 2 ? 0.6f : 0.2f, 0.25f}, 1e-3f);
      EXPECT_NEAR(seen.uv.x, at.x, 1e-5f);
      EXPECT_NEAR(seen.uv.y, at.y, 1e-5f);
      EXPECT_EQ(seen.source_face, 0u);
      EXPECT_EQ(seen.material, 0u);
      EXPECT_EQ(host_->runtime().material_name(seen), "tiles");
    }
  }
  EXPECT_TRUE(host_->messages.empty());
}

TEST_F(CloseUp, WideRaysSeeAverages) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].base_color_map.image = image(64, [](int x, int y) { return vec4(vec3(float((x + y) % 2)), 1); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  expect_near(look(0.5f, 0.5f, 0.25f).albedo, vec3(0.5f), 0.02f);
  EXPECT_GT(std::abs(look(32.5f / 64, 32.5f / 64).albedo.x - 0.5f), 0.4f);
}

TEST_F(CloseUp, CornersAreThoseOfTheSourcesTriangles) {
  SourceMesh mesh = test::square_mesh();
  mesh.corner_position = {0, 1, 2, 2, 3, 0};
  mesh.face_begin = {0, 3, 6};
  mesh.corner_uv.clear();
  mesh.corner_color.clear();
  mesh.face_material = {0, 1};  // so that numbers are kept
  mesh.materials.resize(2);
  mesh.materials[1].name = "second";
  const auto positions = mesh.positions;
  const auto corners = mesh.corner_position;
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  for (const vec2& at : {vec2(0.7f, 0.2f), vec2(0.1f, 0.6f), vec2(0.3f, 0.9f), vec2(0.9f, 0.5f)}) {
    const Interaction seen = look(at.x, at.y);
    ASSERT_EQ(seen.source_face, at.x > at.y ? 0u : 1u);
    EXPECT_EQ(seen.material, seen.source_face);
    const size_t first = 3 * seen.source_face;
    const vec2 b = seen.barycentric;
    const dvec3 p = double(1 - b.x - b.y) * positions[corners[first]] + double(b.x) * positions[corners[first + 1]] +
                    double(b.y) * positions[corners[first + 2]];
    EXPECT_NEAR(p.x, at.x, 1e-5);
    EXPECT_NEAR(p.y, at.y, 1e-5);
    EXPECT_TRUE(std::isnan(seen.uv.x));
  }
  EXPECT_EQ(host_->runtime().material_name(look(0.1f, 0.6f)), "second");
}

TEST_F(CloseUp, NormalsAreInterpolatedAndOnTheSideOfTheRay) {
  SourceMesh mesh = test::square_mesh();
  const float s = std::sqrt(0.5f);
  mesh.corner_normal = {{-s, 0, s}, {s, 0, s}, {s, 0, s}, {-s, 0, s}};
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  expect_near(look(0.5f, 0.4f).shading_normal, {0, 0, 1}, 1e-3f);
  expect_near(look(0.75f, 0.4f).shading_normal, glm::normalize(vec3(0.5f, 0, 1)), 1e-3f);
  expect_near(look(0.75f, 0.4f).geometric_normal, {0, 0, 1}, 1e-5f);
  RayContext context;
  EmbreeRayHit hit;
  ASSERT_TRUE(host_->trace({0.75f, 0.4f, -3}, {0, 0, 1}, context, hit));
  expect_near(host_->interaction(hit, context).shading_normal, -glm::normalize(vec3(0.5f, 0, 1)), 1e-3f);
}

TEST_F(CloseUp, NormalMapsBendNormalsAlongTheTexturesAxes) {
  SourceMesh mesh = test::square_mesh();
  const vec3 n = glm::normalize(vec3(0.5f, 0.25f, 1));
  mesh.materials[0].normal_map.image = image(2, [&](int, int) { return vec4(0.5f * n + 0.5f, 1); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  // u is along x; v points down the image and along y, so "up" is -y.
  expect_near(look(0.3f, 0.3f).shading_normal, {n.x, -n.y, n.z}, 1e-3f);
}

TEST_F(CloseUp, NothingLeavesThroughTheSurfaceWhereNormalsDisagree) {
  SourceMesh mesh = test::square_mesh();
  const vec3 tilted = glm::normalize(vec3(1, 0, 0.3f));
  mesh.corner_normal.assign(4, tilted);
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  const Interaction seen = look(0.5f, 0.5f);
  Rng rng(1);
  EXPECT_EQ(seen.eval(glm::normalize(vec3(1, 0, -0.1f)), rng), vec3(0.0f));
  EXPECT_GT(seen.eval(glm::normalize(vec3(1, 0, 0.5f)), rng).x, 0.1f);
  for (int i = 0; i < 1000; ++i) {
    const ScatterSample sample = seen.sample(rng);
    EXPECT_TRUE(sample.weight == vec3(0.0f) || sample.wi.z > 0);
  }
}

TEST_F(CloseUp, MasksAreTestedAtTheHit) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].alpha_mode = AlphaMode::Mask;
  mesh.materials[0].base_color_map.image = image(8, [](int x, int) { return vec4(0.5f, 0.5f, 0.5f, x < 2 ? 1 : 0); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  for (uint32_t seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(look(0.1f, 0.5f, 0, seed).kind, Interaction::Kind::Surface);
    EXPECT_EQ(look(0.5f, 0.5f, 0, seed).kind, Interaction::Kind::None);
  }
  expect_near(look(0.1f, 0.5f).albedo, vec3(0.5f), 2e-3f);
  int hits = 0;
  for (uint32_t seed = 0; seed < 2000; ++seed) hits += look(0.5f, 0.5f, 8, seed).kind == Interaction::Kind::Surface;
  EXPECT_NEAR(hits / 2000.0, 0.25, 0.04);  // coverage of the whole
}

TEST_F(CloseUp, BlendedFacesLetTheirShareOfRaysPass) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].alpha_mode = AlphaMode::Blend;
  mesh.materials[0].alpha = 0.5f;
  mesh.corner_color.assign(4, vec4(1, 1, 1, 0.6f));
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  int hits = 0;
  for (uint32_t seed = 0; seed < 4000; ++seed) hits += look(0.5f, 0.5f, 0, seed).kind == Interaction::Kind::Surface;
  EXPECT_NEAR(hits / 4000.0, 0.3, 0.03);
}

TEST_F(CloseUp, FacesShine) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].emission = {3, 2, 1};
  mesh.materials[0].emission_map.image = image(2, [](int x, int) { return vec4(vec3(x == 0 ? 1.0f : 0.25f), 1); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  expect_near(look(0.25f, 0.5f).emission, {3, 2, 1}, 0.01f);
  expect_near(look(0.75f, 0.5f).emission, {0.75f, 0.5f, 0.25f}, 0.01f);
}

TEST_F(CloseUp, TheHostsFunctionSaysWhatIsThere) {
  SourceMesh mesh = test::square_mesh();
  const MaterialFunction function = [](const MaterialQuery& query) {
    MaterialSample sample;
    sample.diffuse = {query.uv.x, query.uv.y, 0.5f};
    sample.emission = vec3(static_cast<float>(query.face) + NAN);
    sample.opacity = query.uv.x > 0.5f ? 7.0f : 0.0f;
    return sample;
  };
  mesh.material_function = function;
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh), function));
  const Interaction seen = look(0.75f, 0.25f);
  expect_near(seen.albedo, {0.75f, 0.25f, 0.5f}, 1e-4f);
  EXPECT_EQ(seen.emission, vec3(0.0f));  // NaN is none
  EXPECT_EQ(look(0.25f, 0.25f).kind, Interaction::Kind::None);

  // Without the function: what the bake saw, on average over what it saw of each triangle. Of rays, a share passes.
  ASSERT_NO_FATAL_FAILURE(open());
  Interaction stopped;
  for (uint32_t seed = 1; seed <= 64 && stopped.kind == Interaction::Kind::None; ++seed) {
    stopped = look(0.75f, 0.25f, 0, seed);
  }
  expect_near(stopped.albedo, {0.778f, 0.389f, 0.5f}, 0.04f);
}

TEST_F(CloseUp, TexturesThatDoNotFitLeaveAverages) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].base_color_map.image = image(512, [](int x, int) { return vec4(vec3(x < 256 ? 1.0f : 0.0f), 1); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh), {}, 1 << 20));
  EXPECT_NEAR(look(0.9f, 0.1f).albedo.x, 0.25f, 0.01f);  // the triangle (0,0) (1,0) (1,1): a quarter is white
  ASSERT_EQ(host_->messages.size(), 1u);
  EXPECT_NE(host_->messages[0].find("one colour per face"), std::string::npos) << host_->messages[0];
  EXPECT_LE(host_->runtime().stats().peak_accounted_bytes, uint64_t{1} << 20);

  // 512^2 texels of 3 channels of 2 bytes and their smaller levels, and OpenImageIO's own.
  ASSERT_NO_FATAL_FAILURE(open({}, 8 << 20));
  EXPECT_NEAR(look(0.9f, 0.1f).albedo.x, 0.0f, 0.01f);
  EXPECT_GT(host_->runtime().stats().accounted_bytes, 512u * 512 * 6);
}

TEST_F(CloseUp, ATextureThatIsGoneIsSaidOnce) {
  SourceMesh mesh = test::square_mesh();
  mesh.materials[0].base_color_map.image = image(64, [](int x, int) { return vec4(vec3(x < 32 ? 1.0f : 0.0f), 1); });
  ASSERT_NO_FATAL_FAILURE(show(std::move(mesh)));
  for (const char* content : {"", "no image"}) {
    std::ofstream(out() / "texture_0.tif", std::ios::trunc) << content;
    ASSERT_NO_FATAL_FAILURE(open());
    for (int i = 0; i < 5; ++i) EXPECT_NEAR(look(0.9f, 0.1f).albedo.x, 0.25f, 0.01f);
    ASSERT_EQ(host_->messages.size(), 1u);
    EXPECT_NE(host_->messages[0].find("texture_0.tif"), std::string::npos) << host_->messages[0];
  }
}

}  // namespace
}  // namespace farfield
