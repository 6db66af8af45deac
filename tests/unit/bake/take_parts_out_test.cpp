// SPDX-License-Identifier: Apache-2.0
#include "bake/take_parts_out.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "base/index.h"
#include "cache/placed_parts.h"
#include "prefilter/condition.h"

namespace farfield {
namespace {

/// A strip of triangles, `count` of them, along x.
void add_strip(SourceMesh& mesh, uint32_t number, uint32_t count, const glm::dmat4x3& to_asset, uint32_t material = 0) {
  const auto base = static_cast<uint32_t>(mesh.positions.size());
  const size_t first_face = mesh.face_count();
  const glm::dmat3 of_normals = glm::transpose(glm::inverse(glm::dmat3(to_asset[0], to_asset[1], to_asset[2])));
  for (uint32_t i = 0; i < count + 2; ++i) {
    mesh.positions.push_back(to_asset * glm::dvec4(0.5 * i, i % 2, 0.1 * (i % 3), 1));
  }
  for (uint32_t i = 0; i < count; ++i) {
    for (const uint32_t v : {i, i + 1, i + 2}) {
      mesh.corner_position.push_back(base + v);
      mesh.corner_normal.emplace_back(glm::normalize(of_normals * glm::dvec3(0.3, 0.1 * (v % 3), 1)));
      mesh.corner_uv.emplace_back(float(v), 0.0f);
    }
    mesh.face_begin.push_back(static_cast<uint32_t>(mesh.corner_count()));
    mesh.face_material.push_back(material);
  }
  mesh.placements.push_back({number, first_face, count, to_asset});
}

glm::dmat4x3 place(double turn, const dvec3& at, const dvec3& scale = dvec3(1)) {
  const glm::dmat4 m = glm::scale(glm::rotate(glm::translate(glm::dmat4(1.0), at), turn, dvec3(0.2, 1, 0.1)), scale);
  return glm::dmat4x3(m);
}

SourceMesh empty_mesh() {
  SourceMesh mesh;
  mesh.materials.resize(2);
  return mesh;
}

/// A trunk of 10 triangles between 20 twigs of 300, one of them mirrored.
SourceMesh twigs_on_a_trunk() {
  SourceMesh mesh = empty_mesh();
  for (int i = 0; i < 20; ++i) {
    if (i == 10) add_strip(mesh, 0, 10, place(0, dvec3(0, -5, 0)), 1);
    add_strip(mesh, 1, 300, place(i, dvec3(0, i, 100 + i), i == 5 ? dvec3(-2, 1, 1) : dvec3(1)));
  }
  return mesh;
}

SourceSurface conditioned(SourceMesh mesh) {
  auto asset = condition(std::move(mesh), "test");
  EXPECT_TRUE(asset) << asset.error().message;
  return std::move(asset->source);
}

TEST(TakePartsOut, WhatIsRepeatedIsThereOnceAndStandsWhereItStood) {
  const SourceSurface source = conditioned(twigs_on_a_trunk());
  const auto parted = take_parts_out(source);
  ASSERT_TRUE(parted);
  const SourceSurface& surface = parted->surface;
  ASSERT_EQ(surface.triangles.size(), 310u);
  EXPECT_EQ(parted->part.front(), 0u);
  EXPECT_EQ(parted->part[9], 0u);
  EXPECT_EQ(parted->part[10], 1u);
  EXPECT_EQ(surface.material[9], 1u);
  EXPECT_EQ(surface.material[10], 0u);
  ASSERT_EQ(parted->places.size(), 20u);
  for (size_t i = 0; i < parted->places.size(); ++i) {
    const PartPlacement& placement = parted->places[i];
    EXPECT_EQ(placement.part, 0u);
    const glm::dmat4x3 transform = to_level(placement);
    const glm::dmat3 of_normals = glm::transpose(glm::inverse(glm::dmat3(transform[0], transform[1], transform[2])));
    const size_t first = 300 * i + (i >= 10 ? 10 : 0);  // triangles of the source
    EXPECT_EQ(placement.source_face_offset, first);
    for (size_t t = 0; t < 300; t += 7) {
      EXPECT_EQ(surface.source_face[10 + t] + placement.source_face_offset, source.source_face[first + t]);
      for (int k = 0; k < 3; ++k) {
        const vec3 there = source.positions[source.triangles[first + t][k]];
        const dvec3 placed = transform * glm::dvec4(surface.positions[surface.triangles[10 + t][k]], 1);
        EXPECT_LT(glm::length(dvec3(there) - placed), 1e-4);
        const size_t corner = static_cast<size_t>(k);
        EXPECT_EQ(source.corner_uv[3 * (first + t) + corner], surface.corner_uv[3 * (10 + t) + corner]);
        const dvec3 normal = glm::normalize(of_normals * dvec3(surface.corner_normal[3 * (10 + t) + corner]));
        EXPECT_GT(glm::dot(normal, dvec3(source.corner_normal[3 * (first + t) + corner])), 0.9999);
      }
    }
  }
}

TEST(TakePartsOut, FewPlacesOfFewTrianglesStayFlat) {
  SourceMesh cards = empty_mesh();
  for (int i = 0; i < 1000; ++i) add_strip(cards, 0, 2, place(i, dvec3(0, i, 0)));
  EXPECT_FALSE(take_parts_out(conditioned(std::move(cards)))) << "a place takes more than two triangles";
  SourceMesh two = empty_mesh();
  for (int i = 0; i < 2; ++i) add_strip(two, 0, 20, place(i, dvec3(0, i, 0)));
  EXPECT_FALSE(take_parts_out(conditioned(std::move(two)))) << "a part has a scene of its own";
  SourceMesh once = empty_mesh();
  add_strip(once, 0, 5000, place(0, dvec3(0)));
  EXPECT_FALSE(take_parts_out(conditioned(std::move(once))));
}

TEST(TakePartsOut, PlacesThatDifferStayFlatAndOthersDoNot) {
  SourceMesh mesh = twigs_on_a_trunk();
  mesh.face_material[0] = 1;  // of the first twig alone
  for (int i = 0; i < 20; ++i) add_strip(mesh, 2, 200, place(i, dvec3(50, i, 0)));
  const auto parted = take_parts_out(conditioned(std::move(mesh)));
  ASSERT_TRUE(parted);
  EXPECT_EQ(parted->places.size(), 20u);
  EXPECT_EQ(parted->surface.triangles.size(), 20 * 300 + 10 + 200u);
  SourceMesh collapsed = twigs_on_a_trunk();
  collapsed.positions[collapsed.corner_position[3 * 300]] = collapsed.positions[collapsed.corner_position[3 * 300 + 1]];
  EXPECT_FALSE(take_parts_out(conditioned(std::move(collapsed)))) << "a face of the second twig has no area";
}

TEST(TakePartsOut, PlacesThatCollapsedAltogetherAreNotThere) {
  SourceMesh mesh = twigs_on_a_trunk();
  for (uint32_t i = 0; i < 302; ++i) mesh.positions[i] = dvec3(1);
  const auto parted = take_parts_out(conditioned(std::move(mesh)));
  ASSERT_TRUE(parted);
  EXPECT_EQ(parted->places.size(), 19u);
}

TEST(TakePartsOut, FarFromItsOriginNothingIsLost) {
  SourceMesh mesh = empty_mesh();
  for (int i = 0; i < 20; ++i) add_strip(mesh, 0, 300, place(i, dvec3(1e7, i, 0)));
  const SourceSurface source = conditioned(std::move(mesh));
  ASSERT_GT(source.origin.x, 9e6);
  const auto parted = take_parts_out(source);
  ASSERT_TRUE(parted);
  const glm::dmat4x3 transform = to_level(parted->places[3]);
  for (size_t t = 0; t < 300; ++t) {
    const dvec3 placed = transform * glm::dvec4(parted->surface.positions[parted->surface.triangles[t].x], 1);
    EXPECT_LT(glm::length(placed - dvec3(source.positions[source.triangles[900 + t].x])), 1e-4);
  }
}

TEST(TakePartsOut, AHostsFunctionSeesEveryPlace) {
  SourceMesh mesh = twigs_on_a_trunk();
  mesh.material_function = [](const MaterialQuery&) { return MaterialSample(); };
  EXPECT_FALSE(take_parts_out(conditioned(std::move(mesh))));
}

}  // namespace
}  // namespace farfield
