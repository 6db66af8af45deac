// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>

namespace farfield {
namespace {

/// A unit square and a triangle on its upper edge. Owns what `mesh` looks at.
struct House {
  std::vector<dvec3> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 2, 0}};
  std::vector<int64_t> corners = {0, 1, 2, 3, 3, 2, 4};
  std::vector<int> counts = {4, 3};
  std::vector<uint8_t> materials = {1, 0};
  std::vector<vec2> uv = std::vector<vec2>(7, vec2(0.5f));
  std::vector<vec3> normals = std::vector<vec3>(5, vec3(0, 0, 2));

  BakeMesh mesh() const {
    BakeMesh mesh;
    mesh.name = "house";
    mesh.points = points;
    mesh.corners = corners;
    mesh.counts = counts;
    mesh.materials = materials;
    mesh.uv = {uv, BakePer::Corner};
    mesh.normals = {normals, BakePer::Point};
    return mesh;
  }
  BakeInput input() const {
    BakeInput input;
    input.meshes = {mesh()};
    return input;
  }
};

std::string error_of(const BakeInput& input) {
  const auto gathered = gather_mesh(input);
  if (gathered) return "";
  EXPECT_EQ(gathered.error().code, ErrorCode::InvalidArgument);
  return gathered.error().message;
}

TEST(GatherMesh, CopiesPolygonsWithWhatTheyCarry) {
  House house;
  for (size_t i = 0; i < house.uv.size(); ++i) house.uv[i] = vec2(i, 10 * i);
  const SourceMesh mesh = gather_mesh(house.input()).value();
  EXPECT_EQ(mesh.positions, house.points);
  EXPECT_EQ(mesh.face_begin, (std::vector<uint32_t>{0, 4, 7}));
  EXPECT_EQ(mesh.corner_position, (std::vector<uint32_t>{0, 1, 2, 3, 3, 2, 4}));
  EXPECT_EQ(mesh.face_material, (std::vector<uint32_t>{1, 0}));
  EXPECT_EQ(mesh.corner_uv, house.uv);
  EXPECT_EQ(mesh.corner_normal, std::vector<vec3>(7, vec3(0, 0, 1)));
  EXPECT_TRUE(mesh.corner_color.empty());
  EXPECT_TRUE(mesh.warnings.empty());
}

TEST(GatherMesh, ReadsRowsInsideStructsAndOfAnyNumbers) {
  struct Vertex {
    uint8_t flags;
    float position[3];
    uint8_t color[4];
  };
  const std::vector<Vertex> vertices = {
      {1, {0, 0, 0}, {0, 0, 0, 1}}, {2, {1, 0, 0}, {1, 0, 0, 1}}, {3, {0, 1, 0}, {0, 1, 0, 1}}};
  const uint16_t triangle[] = {2, 1, 0};
  BakeInput input;
  input.meshes.resize(1);
  input.meshes[0].points = {vertices[0].position, vertices.size(), sizeof(Vertex)};
  input.meshes[0].corners = {triangle, 3};
  input.meshes[0].colors = {{vertices[0].color, vertices.size(), sizeof(Vertex)}, BakePer::Point};
  const SourceMesh mesh = gather_mesh(input).value();
  EXPECT_EQ(mesh.positions, (std::vector<dvec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.corner_position, (std::vector<uint32_t>{2, 1, 0}));
  EXPECT_EQ(mesh.corner_color, (std::vector<vec4>{{0, 1, 0, 1}, {1, 0, 0, 1}, {0, 0, 0, 1}}));
}

TEST(GatherMesh, PutsEveryInstanceInItsPlace) {
  const House house;
  BakeInput input = house.input();
  glm::dmat4x3 shifted(1.0), mirrored(1.0);
  shifted[3] = dvec3(0, 0, 1e9);  // beyond what float tells apart from the next millimetre
  mirrored[0] = dvec3(-2, 0, 0);
  input.instances = {{0, shifted}, {0, mirrored}};
  const SourceMesh mesh = gather_mesh(input).value();
  ASSERT_EQ(mesh.positions.size(), 10u);
  EXPECT_EQ(mesh.positions[4], dvec3(0.5, 2, 1e9));
  EXPECT_EQ(mesh.positions[9], dvec3(-1, 2, 0));
  EXPECT_EQ(mesh.face_begin, (std::vector<uint32_t>{0, 4, 7, 11, 14}));
  EXPECT_EQ(mesh.corner_position[4], 3u);
  // The mirror image winds the other way, so that its faces look to where its normals do.
  EXPECT_EQ((std::vector<uint32_t>(mesh.corner_position.begin() + 7, mesh.corner_position.end())),
            (std::vector<uint32_t>{8, 7, 6, 5, 9, 7, 8}));
  const auto at = [&](size_t corner) { return mesh.positions[mesh.corner_position[corner]]; };
  EXPECT_GT(glm::cross(at(8) - at(7), at(9) - at(8)).z, 0.0);
  EXPECT_EQ(mesh.corner_normal[7], vec3(0, 0, 1));
}

TEST(GatherMesh, TurnsNormalsWithTheSurface) {
  House house;
  house.normals.assign(5, vec3(1, 1, 0));
  BakeInput input = house.input();
  glm::dmat4x3 stretched(1.0);
  stretched[0] = dvec3(2, 0, 0);
  input.instances = {{0, stretched}};
  const vec3 normal = gather_mesh(input).value().corner_normal[0];
  // Perpendicular to what (1, -1, 0) in the surface has become.
  EXPECT_NEAR(glm::dot(normal, vec3(2, -1, 0)), 0, 1e-6);
  EXPECT_NEAR(glm::length(normal), 1, 1e-6);
}

TEST(GatherMesh, FillsUpWhatOneMeshLacks) {
  const House house;
  BakeInput input = house.input();
  input.meshes.push_back(house.mesh());
  input.meshes[1].uv = {};
  input.meshes[1].normals = {};
  input.meshes[1].materials = {};
  const SourceMesh mesh = gather_mesh(input).value();
  ASSERT_EQ(mesh.corner_uv.size(), 14u);
  EXPECT_TRUE(std::isnan(mesh.corner_uv[7].x));
  EXPECT_EQ(mesh.corner_normal[7], vec3(0.0f));
  EXPECT_EQ(mesh.face_material, (std::vector<uint32_t>{1, 0, 0, 0}));
}

TEST(GatherMesh, SaysWhichMeshIsEmpty) {
  const House house;
  BakeInput input = house.input();
  input.meshes.emplace_back().name = "nothing";
  EXPECT_EQ(gather_mesh(input).value().warnings, (std::vector<std::string>{"mesh 1 (nothing): has no faces"}));
}

TEST(GatherMesh, NamesTheMeshAndTheElementThatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* message;
    void (*spoil)(House&, double);
  };
  const Case cases[] = {
      {"point 3 is not finite", [](House& h, double bad) { h.points[3].y = bad; }},
      {"corner 5 has point 5; there are points 0 to 4", [](House& h, double) { h.corners[5] = 5; }},
      {"corner 0 has point -1; there are", [](House& h, double) { h.corners[0] = -1; }},
      {"face 1 has 2 corners; 3 are the fewest", [](House& h, double) { h.counts[1] = 2; }},
      {"face 0 has -4 corners", [](House& h, double) { h.counts[0] = -4; }},
      {"the counts of 2 faces add up to 8, but there are 7 corners", [](House& h, double) { h.counts[1] = 4; }},
      {"7 corners are no whole triangles", [](House& h, double) { h.counts.clear(); }},
      {"3 material ids for 2 faces", [](House& h, double) { h.materials.push_back(0); }},
      {"6 uv coordinates for 7 corners", [](House& h, double) { h.uv.pop_back(); }},
      {"uv coordinates 2 are not finite", [](House& h, double bad) { h.uv[2].x = static_cast<float>(bad); }},
      {"6 normals for 5 points", [](House& h, double) { h.normals.emplace_back(); }},
      {"normals 4 are not finite", [](House& h, double bad) { h.normals[4].z = static_cast<float>(bad); }},
  };
  for (const Case& wrong : cases) {
    House house;
    wrong.spoil(house, nan);
    EXPECT_EQ(error_of(house.input()).rfind(std::string("mesh 0 (house): ") + wrong.message, 0), 0u)
        << error_of(house.input()) << "\ninstead of " << wrong.message;
  }
}

TEST(GatherMesh, KnowsWhichMaterialsThereAre) {
  House house;
  house.materials = {1, 2};
  BakeInput input = house.input();
  EXPECT_EQ(error_of(input), "");  // no materials at all: grey
  input.materials.resize(2);
  EXPECT_NE(error_of(input).find("face 1 has material 2; there are materials 0 to 1"), std::string::npos);
  input.material_function = [](const MaterialQuery&) { return MaterialSample{}; };
  EXPECT_EQ(error_of(input), "");
}

TEST(GatherMesh, RefusesInstancesThatAreNoPlaces) {
  const House house;
  const auto error_with = [&](uint32_t mesh, const dvec3& x_axis) {
    BakeInput input = house.input();
    glm::dmat4x3 to_asset(1.0);
    to_asset[0] = x_axis;
    input.instances = {{0, glm::dmat4x3(1.0)}, {mesh, to_asset}};
    return error_of(input);
  };
  EXPECT_EQ(error_with(0, {1, 0, 0}), "");
  EXPECT_NE(error_with(1, {1, 0, 0}).find("instance 1: mesh 1 of 1"), std::string::npos);
  EXPECT_NE(error_with(0, {0, 1, 0}).find("instance 1: its transform cannot be inverted"), std::string::npos);
  EXPECT_NE(error_with(0, {NAN, 0, 0}).find("instance 1: its transform is not finite"), std::string::npos);
}

TEST(GatherMesh, RefusesNothing) {
  EXPECT_NE(error_of({}).find("no face"), std::string::npos);
  BakeInput input;
  input.meshes.resize(2);
  EXPECT_NE(error_of(input).find("no face"), std::string::npos);
}

TEST(GatherMesh, CopiesCreasesOfEveryInstance) {
  House house;
  const std::vector<glm::ivec2> creases = {{3, 2}, {4, 3}};
  const std::vector<double> sharpness = {2.5, std::numeric_limits<double>::infinity()};
  const std::vector<int> points = {4};
  const std::vector<float> point_sharpness = {1};
  BakeInput input = house.input();
  input.meshes[0].creases = creases;
  input.meshes[0].crease_sharpness = sharpness;
  input.meshes[0].sharp_points = points;
  input.meshes[0].point_sharpness = point_sharpness;
  input.instances.resize(2);
  const CageTags cage = gather_mesh(input).value().cage;
  EXPECT_EQ(cage.crease_edges, (std::vector<glm::uvec2>{{3, 2}, {4, 3}, {8, 7}, {9, 8}}));
  ASSERT_EQ(cage.crease_sharpness.size(), 4u);
  EXPECT_EQ(cage.crease_sharpness[2], 2.5f);
  EXPECT_GE(cage.crease_sharpness[3], kInfiniteSharpness);
  EXPECT_EQ(cage.sharp_vertices, (std::vector<uint32_t>{4, 9}));
  EXPECT_EQ(cage.vertex_sharpness, (std::vector<float>{1, 1}));
}

TEST(GatherMesh, NamesTheCreaseThatIsWrong) {
  House house;
  const auto error = [&](const std::vector<glm::ivec2>& creases, const std::vector<double>& sharpness,
                         const std::vector<double>& points, const std::vector<double>& point_sharpness) {
    BakeInput input = house.input();
    input.meshes[0].creases = creases;
    input.meshes[0].crease_sharpness = sharpness;
    input.meshes[0].sharp_points = points;
    input.meshes[0].point_sharpness = point_sharpness;
    return error_of(input);
  };
  EXPECT_EQ(error({{0, 1}}, {1}, {}, {}), "");
  EXPECT_NE(error({{0, 1}, {0, 2}}, {1, 1}, {}, {}).find("(house): crease 1 lies between points 0 and 2"),
            std::string::npos);
  EXPECT_NE(error({{0, 99}}, {1}, {}, {}).find("crease 0"), std::string::npos);
  EXPECT_NE(error({{-1, 0}}, {1}, {}, {}).find("crease 0"), std::string::npos);
  EXPECT_NE(error({{0, 1}}, {}, {}, {}).find("0 values of sharpness for 1 creases"), std::string::npos);
  EXPECT_NE(error({{0, 1}}, {-1}, {}, {}).find("sharpness 0 of its creases is -1"), std::string::npos);
  EXPECT_NE(error({{0, 1}}, {NAN}, {}, {}).find("sharpness 0 of its creases is nan"), std::string::npos);
  EXPECT_NE(error({}, {}, {5}, {1}).find("sharp point 0 is 5; there are points 0 to 4"), std::string::npos);
  EXPECT_NE(error({}, {}, {1.5}, {1}).find("sharp point 0 is 1.5"), std::string::npos);
  EXPECT_NE(error({}, {}, {0}, {1, 2}).find("2 values of sharpness for 1 sharp points"), std::string::npos);
}

}  // namespace
}  // namespace farfield
