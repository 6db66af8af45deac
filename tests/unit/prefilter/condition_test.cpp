// SPDX-License-Identifier: Apache-2.0
// import_asset on small files of every format: geometry, materials, textures, errors, hostile bytes.
#include "prefilter/condition.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/imported_surface.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

using namespace test;

namespace fs = std::filesystem;

const char* const kQuadObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

void expect_near(const vec3& a, const vec3& b, float tolerance = 1e-5f) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], tolerance) << fmt::format("({}, {}, {})", a.x, a.y, a.z);
}

float srgb(int byte) {
  const float v = static_cast<float>(byte) / 255.0f;
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

/// Mean material of the first and last face.
const FaceMaterial& first_material(const Result<test::ImportedSurface>& asset) {
  return asset->surface.materials.front();
}

// ---- OBJ

TEST(ImportObj, FaceOfThousandCornersIsKeptWhole) {
  std::string obj;
  const int n = 1000;
  for (int i = 0; i < n; ++i) {
    obj += fmt::format("v {} {} 0\n", std::cos(2 * 3.14159265358979 * i / n), std::sin(2 * 3.14159265358979 * i / n));
  }
  obj += "f";
  for (int i = 1; i <= n; ++i) obj += fmt::format(" {}", i);
  const TemporaryFolder folder;
  const auto asset = test::import_surface(folder.write("disc.obj", obj));
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(asset->surface.triangles.size(), 998u);
}

TEST(ImportObj, AllWaysToWriteAFaceAreOne) {
  const TemporaryFolder folder;
  for (const char* face :
       {"f 1 2 3 4", "f 1// 2// 3// 4//", "f 1/1 2/1 3/1 4/1", "f 1//1 2//1 3//1 4//1", "f 1/1/1 2/1/1 3/1/1 4/1/1",
        "f -4 -3 -2 -1", "f\t1 \\\n 2 3 \\\r\n4\r", "f 1/-1/-1 2/-1/-1 3/-1/-1 4/-1/-1", "f 1 2 3 4 # end"}) {
    const auto asset =
        test::import_surface(folder.write("quad.obj", std::string(kQuadObj) + "vt 0 0\nvn 0 0 1\n# C:\\\n" + face));
    ASSERT_TRUE(asset) << face << ": " << asset.error().message;
    EXPECT_EQ(asset->surface.triangles.size(), 2u) << face;
    EXPECT_EQ(asset->surface.positions.size(), 4u) << face;
    EXPECT_EQ(first_material(asset).sggx, SymMat3::outer(vec3(0, 0, 1))) << face;
  }
}

TEST(ImportObj, FacesOfFourCornersAreQuads) {
  const TemporaryFolder folder;
  const std::string points = std::string(kQuadObj) + "v 2 0 0\nv 2 1 0\nv 3 0 0\nv 1 2 0\nv 0.5 3 0\n";
  // A quad, a triangle, a quad, one with a corner twice, one of five corners of which three are in line.
  const auto mixed =
      test::import_surface(folder.write("a.obj", points + "f 1 2 3 4\nf 5 7 6\nf 2 5 6 3\nf 5 7 7 3\nf 4 3 6 8 9\n"));
  ASSERT_TRUE(mixed) << mixed.error().message;
  const uint32_t none = 0xffffffffu;
  EXPECT_EQ(mixed->surface.quad, (std::vector<uint32_t>{0, 0, none, 1, 1, none, none, none}));
  const auto triangles = test::import_surface(folder.write("b.obj", points + "f 1 2 3\nf 3 4 1\n"));
  ASSERT_TRUE(triangles) << triangles.error().message;
  EXPECT_FALSE(triangles->surface.has_quads());
}

TEST(ImportObj, BlenderMaterialsMeanWhatBlenderMeans) {
  const TemporaryFolder folder;
  folder.write("m.mtl",
               "# Blender 3.4.1 MTL File: 'None'\nnewmtl a\nNs 250\nKa 1 1 1\nKd 0.45 0.25 0.12\nKs 0.5 0.5 0.5\nNi "
               "1.45\nd 1\nillum 2\n");
  const auto asset =
      test::import_surface(folder.write("a.obj", std::string("mtllib m.mtl\nusemtl a\n") + kQuadObj + "f 1 2 3 4\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  const FaceMaterial& m = first_material(asset);
  expect_near(m.specular, vec3(0.04f));               // 0.08 Ks
  expect_near(m.diffuse, vec3(0.45f, 0.25f, 0.12f));  // of what the highlight leaves
  EXPECT_NEAR(m.roughness2, 0.0625, 1e-5);            // roughness 0.5 = 1 - sqrt(250 / 1000)
  EXPECT_TRUE(asset->warnings.empty());
}

TEST(ImportObj, PhongAndPbrMaterialsOfOtherPrograms) {
  const TemporaryFolder folder;
  folder.write("m.mtl",
               "newmtl phong\nKd 0.2 0.2 0.2\nKs 0.3 0.3 0.3\nNs 30\nillum 2\nnewmtl pbr\nKd 1 0 0\nPr 0.5\nPm 1\n"
               "newmtl plain\nKd 0.5 0.5 0.5\nKs 1 1 1\nillum 1\n");
  const std::string obj = std::string("mtllib m.mtl\n") + kQuadObj + "v 0 0 5\nv 0 0 6\n";
  const auto asset = test::import_surface(
      folder.write("a.obj", obj + "usemtl phong\nf 1 2 5\nusemtl pbr\nf 1 2 6\nusemtl plain\nf 3 2 6\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  const auto& m = asset->surface.materials;
  ASSERT_EQ(m.size(), 3u);
  expect_near(m[0].specular, 0.04f * vec3(0.3f));  // a strength, no reflectance
  EXPECT_NEAR(m[0].roughness2, 2.0 / 32, 1e-5);
  expect_near(m[1].specular, vec3(1, 0, 0));
  expect_near(m[1].diffuse, vec3(0.0f));
  EXPECT_NEAR(m[1].roughness2, 0.0625, 1e-5);
  expect_near(m[2].specular, vec3(0.0f));
  expect_near(m[2].diffuse, vec3(0.5f));
}

TEST(ImportObj, TexturesAreFoundAveragedAndTheRightWayUp) {
  const TemporaryFolder folder;
  // top row red, bottom row blue; the face covers the upper half of the image: v from 0.5 to 1
  folder.write("maps/t.png", png(2, 2, {{255, 0, 0, 255}, {255, 0, 0, 255}, {0, 0, 255, 255}, {0, 0, 255, 255}}));
  folder.write("m.mtl", "newmtl a\nKd 1 1 1\nmap_Kd maps\\t.png\n");
  const std::string obj = std::string("mtllib m.mtl\nusemtl a\n") + kQuadObj + "vt 0 0.5\nvt 1 0.5\nvt 1 1\nvt 0 1\n";
  const auto asset = test::import_surface(folder.write("a.obj", obj + "f 1/1 2/2 3/3 4/4\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  for (const FaceMaterial& m : asset->surface.materials) expect_near(m.diffuse, vec3(1, 0, 0), 1e-4f);
}

TEST(ImportObj, CuttingMasksStopsWhenAsked) {
  const TemporaryFolder folder;
  folder.write("mask.png", png(2, 1, {{255, 255, 255, 255}, {0, 0, 0, 0}}));
  folder.write("m.mtl", "newmtl a\nmap_d mask.png\n");
  const std::string obj = std::string("mtllib m.mtl\nusemtl a\n") + kQuadObj + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  const fs::path path = folder.write("a.obj", obj + "f 1/1 2/2 3/3 4/4\n");
  std::atomic<bool> cancel{false};
  EXPECT_TRUE(test::import_surface(path, {}, {{}, &cancel}));
  cancel = true;
  const auto asset = test::import_surface(path, {}, {{}, &cancel});
  ASSERT_FALSE(asset);
  EXPECT_EQ(asset.error().code, ErrorCode::Cancelled);
}

TEST(ImportObj, DissolveMapCutsTheFace) {
  const TemporaryFolder folder;
  std::vector<std::array<uint8_t, 4>> texels(64 * 64, {0, 0, 0, 255});
  for (size_t i = 0; i < 64 * 64; ++i) {
    if (i % 64 < 16) texels[i] = {255, 255, 255, 255};  // grey image: its value is the mask; opaque left quarter
  }
  folder.write("mask.png", png(64, 64, texels));
  folder.write("m.mtl", "newmtl a\nKd 0.3 0.6 0.9\nmap_d -clamp on mask.png\n");
  const std::string obj = std::string("mtllib m.mtl\nusemtl a\n") + kQuadObj + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  const auto asset = test::import_surface(folder.write("a.obj", obj + "f 1/1 2/2 3/3 4/4\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  // RGBA image: alpha is its mask channel, and that is 1 everywhere
  EXPECT_EQ(asset->surface.triangles.size(), 2u);
  for (auto& t : texels) t[3] = t[0];
  folder.write("mask.png", png(64, 64, texels));
  const auto cut = test::import_surface(folder.path() / "a.obj");
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_NEAR(cut->surface.bounds().upper.x, 0.25, 0.01);
  EXPECT_NE(cut->source_hash, asset->source_hash);  // the texture is part of the source
}

TEST(ImportObj, MissingTextureIsAWarningAndThePlainColour) {
  const TemporaryFolder folder;
  folder.write("m.mtl", "newmtl a\nKd 0.1 0.2 0.3\nmap_Kd nowhere.png\n");
  const auto asset =
      test::import_surface(folder.write("a.obj", std::string("mtllib m.mtl\nusemtl a\n") + kQuadObj + "f 1 2 3\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  expect_near(first_material(asset).diffuse, vec3(0.1f, 0.2f, 0.3f));
  ASSERT_EQ(asset->warnings.size(), 1u);
  EXPECT_NE(asset->warnings[0].find("nowhere.png"), std::string::npos);
}

TEST(ImportObj, VertexColoursAreSrgbAndTintTheMaterial) {
  const TemporaryFolder folder;
  const auto asset =
      test::import_surface(folder.write("a.obj", "v 0 0 0 0.5 0 1\nv 1 0 0 0.5 0 1\nv 0 1 0 0.5 0 1\nf 1 2 3\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  expect_near(first_material(asset).diffuse, vec3(0.21404f, 0, 1), 1e-4f);
}

TEST(ImportObj, LibraryNameWithBlanksAndGzippedLibrary) {
  const TemporaryFolder folder;
  folder.write("my maps.mtl", "newmtl a\nKd 0.1 0.1 0.1\n");
  folder.write("packed.mtl.gz", gzip("newmtl b\nKd 0.9 0.9 0.9\n"));
  const auto asset =
      test::import_surface(folder.write("a.obj.gz", gzip(std::string("mtllib my maps.mtl\nmtllib packed.mtl\n") +
                                                         kQuadObj + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n")));
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_TRUE(asset->warnings.empty());
  expect_near(asset->surface.materials[0].diffuse, vec3(0.1f));
  expect_near(asset->surface.materials[1].diffuse, vec3(0.9f));
}

TEST(ImportObj, WithoutMaterialFacesAreBlendersGrey) {
  const TemporaryFolder folder;
  const auto asset = test::import_surface(folder.write("a.obj", std::string(kQuadObj) + "f 1 2 3\n"));
  ASSERT_TRUE(asset);
  expect_near(first_material(asset).diffuse, vec3(0.8f));
  expect_near(first_material(asset).specular, vec3(0.0f));
}

// ---- PLY

const char* const kPlyVertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const char* const kPlyFace = "element face 1\nproperty list uchar int vertex_indices\n";

TEST(ImportPly, AllEncodingsGiveTheSameSurface) {
  const TemporaryFolder folder;
  const std::string head = std::string(kPlyVertex) + "property uchar red\nproperty uchar green\nproperty uchar blue\n" +
                           kPlyFace + "end_header\n";
  const auto encode = [&](bool big) {
    std::string out;
    const auto put = [&](auto value) {
      std::string bytes = raw<decltype(value)>({value});
      if (big) std::reverse(bytes.begin(), bytes.end());
      out += bytes;
    };
    for (const auto& p : {vec3(0, 0, 0), vec3(1, 0, 0), vec3(0, 2.5f, 0)}) {
      for (int c = 0; c < 3; ++c) put(p[c]);
      for (const uint8_t c : {uint8_t{100}, uint8_t{200}, uint8_t{50}}) put(c);
    }
    put(uint8_t{3});
    for (const int32_t i : {0, 1, 2}) put(i);
    return out;
  };
  const std::string ascii = "0 0 0 100 200 50\n1 0 0 100 200 50\n0 2.5 0 100 200 50\n3 0 1 2\n";
  const fs::path files[] = {
      folder.write("a.ply", "ply\nformat ascii 1.0\n" + head + ascii),
      folder.write("l.ply", "ply\r\nformat binary_little_endian 1.0\r\n" + head + encode(false)),
      folder.write("b.ply",
                   "ply\nformat binary_big_endian 1.0\ncomment end_header is not here\n" + head + encode(true))};
  for (const fs::path& file : files) {
    const auto asset = test::import_surface(file);
    ASSERT_TRUE(asset) << asset.error().message;
    ASSERT_EQ(asset->surface.positions.size(), 3u);
    EXPECT_EQ(asset->surface.positions[2], vec3(0, 2.5f, 0));
    expect_near(first_material(asset).diffuse, vec3(srgb(100), srgb(200), srgb(50)));
  }
}

TEST(ImportPly, FacesMayComeBeforeVerticesAndCarryColours) {
  const TemporaryFolder folder;
  const auto asset = test::import_surface(
      folder.write("a.ply", std::string("ply\nformat ascii 1.0\n") + kPlyFace +
                                "property uchar red\nproperty uchar green\nproperty uchar blue\n" + kPlyVertex +
                                "end_header\n3 0 1 2 255 0 128\n0 0 0\n1 0 0\n0 1 0\n"));
  ASSERT_TRUE(asset) << asset.error().message;
  expect_near(first_material(asset).diffuse, vec3(1, 0, srgb(128)));
}

TEST(ImportPly, BrokenHeadersAndIndicesAreRefusedWithAReason) {
  const TemporaryFolder folder;
  const std::string start = "ply\nformat ascii 1.0\n", body = "end_header\n0 0 0\n1 0 0\n0 1 0\n";
  const struct {
    std::string text, reason;
  } cases[] = {
      {"ply\n" + std::string(kPlyVertex) + kPlyFace + body + "3 0 1 2\n", "no format"},
      {"ply\nformat utf16 1.0\n", "unknown format"},
      {start + kPlyVertex + kPlyFace, "no end_header"},
      {start + kPlyVertex + kPlyFace + body + "3 0 1 3\n", "vertex index 3"},
      {start + kPlyVertex + kPlyFace + body + "3 0 1\n", "cut short"},
      {start + kPlyVertex + kPlyFace + body + "-3 0 1 2\n", "cut short"},
      {start + kPlyVertex + kPlyFace + body + "3 0 1 x\n", "cut short"},
      {start + "element vertex -1\n", "bad element count"},
      {start + "element vertex 3\nproperty float x\nproperty float y\nelement face 1\nproperty list uchar int "
               "vertex_indices\nend_header\n0 0\n1 0\n0 1\n3 0 1 2\n",
       "no properties x, y, z"},
      {start + kPlyVertex + "property quad w\n" + kPlyFace + body, "unknown property type"},
      {start + kPlyVertex + "element face 1\nproperty int flags\n" + body + "1\n", "no list vertex_indices"},
      {start + "element vertex 99999999999\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
       "promises 99999999999"},
  };
  for (const auto& c : cases) {
    const auto asset = test::import_surface(folder.write("broken.ply", c.text));
    ASSERT_FALSE(asset) << c.reason;
    EXPECT_EQ(asset.error().code, ErrorCode::BadFile);
    EXPECT_NE(asset.error().message.find(c.reason), std::string::npos) << asset.error().message;
    EXPECT_NE(asset.error().message.find("broken.ply"), std::string::npos);
  }
}

// ---- glTF

/// One triangle with a material. positions: accessor 0; `views` and `accessors` add to that.
std::string material_file(const std::string& material, const std::string& members = "",
                          const std::string& attributes = "", const std::string& accessors = "",
                          const std::string& extra = "") {
  const std::string triangle = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string json = fmt::format(
      R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
      "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{}}},"material":0}}]}}],"materials":[{}],
      "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}{}],
      "bufferViews":[{{"buffer":0,"byteLength":36}}{}],"buffers":[{{"byteLength":{}}}]{}}})",
      attributes, material, accessors.empty() ? "" : "," + accessors,
      extra.empty() ? "" : fmt::format(R"(,{{"buffer":0,"byteOffset":36,"byteLength":{}}})", extra.size()),
      36 + extra.size(), members.empty() ? "" : "," + members);
  return glb(json, triangle + extra);
}

TEST(ImportGltf, MetallicRoughnessMapsToFaceMaterial) {
  const TemporaryFolder folder;
  const auto asset = test::import_surface(folder.write(
      "m.glb",
      material_file(
          R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1],"metallicFactor":0.25,"roughnessFactor":0.5}})")));
  ASSERT_TRUE(asset) << asset.error().message;
  const vec3 base(0.5f, 0.25f, 0.125f), f0 = 0.75f * vec3(0.04f) + 0.25f * base;
  expect_near(first_material(asset).specular, f0);
  // Over this base lies the highlight of the metal, too, which is not the dielectric part's.
  expect_near(first_material(asset).diffuse, 0.75f * base * 0.96f / (1.0f - f0));
  EXPECT_NEAR(first_material(asset).roughness2, 0.0625, 1e-6);
}

TEST(ImportGltf, SpecularIorAndDiffuseTransmissionExtensions) {
  const TemporaryFolder folder;
  const auto asset = test::import_surface(folder.write(
      "m.glb", material_file(
                   R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0},"extensions":{
          "KHR_materials_ior":{"ior":1.45},
          "KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[1,0.5,0]},
          "KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":0.25,"diffuseTransmissionColorFactor":[1,0.5,0]}}})")));
  ASSERT_TRUE(asset) << asset.error().message;
  const float f0 = std::pow(0.45f / 2.45f, 2.0f) * 0.5f;
  const FaceMaterial& m = first_material(asset);
  expect_near(m.specular, vec3(f0, 0.5f * f0, 0));
  expect_near(m.diffuse, vec3(0.75f * 0.5f));
  expect_near(m.transmission, 0.25f * vec3(1, 0.5f, 0));
}

TEST(ImportGltf, WebpTexturesAndSpecularGlossinessAreRead) {
  for (const char* name : {"g17_texture_webp_used.glb", "g17_texture_webp_required.glb", "g14_specgloss.glb"}) {
    const auto mesh = read_source(fs::path(FARFIELD_TEST_DATA) / "import_cases" / name);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_TRUE(mesh->warnings.empty()) << name << ": " << mesh->warnings.front();
    ASSERT_EQ(mesh->materials.size(), 1u);
    const SourceMaterial& material = mesh->materials[0];
    EXPECT_TRUE(material.base_color_map) << name;
    EXPECT_EQ(material.metallic, 0.0f) << name;
    expect_near(material.dielectric_f0, vec3(0.04f));
    EXPECT_EQ(material.roughness, name == std::string("g14_specgloss.glb") ? 0.0f : 1.0f);
  }
}

TEST(ImportGltf, ExtensionsThatAreNotReadAreNamedOnce) {
  const TemporaryFolder folder;
  const auto asset = test::import_surface(folder.write(
      "m.glb", material_file("{}", R"("extensionsUsed":["KHR_materials_ior","EXT_of_tomorrow","EXT_of_tomorrow"])")));
  ASSERT_TRUE(asset) << asset.error().message;
  ASSERT_EQ(asset->warnings.size(), 1u);
  EXPECT_NE(asset->warnings[0].find("EXT_of_tomorrow"), std::string::npos);
}

TEST(ImportGltf, TextureTransformMovesTheFootprint) {
  const TemporaryFolder folder;
  const std::string image = png(2, 1, {{255, 0, 0, 255}, {0, 255, 0, 255}});
  const std::string uvs = raw<float>({0, 0, 1, 0, 0, 1});
  const auto file = [&](const std::string& transform) {
    return material_file(
        fmt::format(R"({{"pbrMetallicRoughness":{{"metallicFactor":0,"baseColorTexture":{{"index":0{}}}}}}})",
                    transform),
        fmt::format(R"("textures":[{{"source":0}}],"images":[{{"uri":"t.png"}}])"), R"(,"TEXCOORD_0":1)",
        R"({"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"})", uvs);
  };
  folder.write("t.png", image);
  const auto half = [](const std::string& members) {
    return R"(,"extensions":{"KHR_texture_transform":{)" + members + "}}";
  };
  const auto left = test::import_surface(folder.write("l.glb", file(half(R"("scale":[0.5,1])"))));
  const auto right = test::import_surface(folder.write("r.glb", file(half(R"("scale":[0.5,1],"offset":[0.5,0])"))));
  ASSERT_TRUE(left && right);
  expect_near(first_material(left).diffuse, vec3(1, 0, 0), 1e-3f);
  expect_near(first_material(right).diffuse, vec3(0, 1, 0), 1e-3f);
  // A triangle over the whole image: three quarters of it lie on the left half.
  const auto whole = test::import_surface(folder.write("w.glb", file("")));
  ASSERT_TRUE(whole);
  expect_near(first_material(whole).diffuse, vec3(0.75f, 0.25f, 0), 1e-3f);
}

TEST(ImportGltf, VertexColoursAreLinearAndMultiply) {
  const TemporaryFolder folder;
  const std::string colors = raw<uint8_t>({255, 128, 0, 255, 255, 128, 0, 255, 255, 128, 0, 255});
  const auto asset = test::import_surface(folder.write(
      "c.glb",
      material_file(R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"metallicFactor":0}})", "",
                    R"(,"COLOR_0":1)",
                    R"({"bufferView":1,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"})", colors)));
  ASSERT_TRUE(asset) << asset.error().message;
  expect_near(first_material(asset).diffuse, 0.5f * vec3(1, 128 / 255.0f, 0));
}

TEST(ImportGltf, QuantizedPositionsAreDecoded) {
  const std::string shorts = raw<int16_t>({0, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0});  // stride 8
  const std::string json = R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_mesh_quantization"],
      "extensionsRequired":["KHR_mesh_quantization"],"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"scale":[2,2,2]}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "accessors":[{"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"}],
      "bufferViews":[{"buffer":0,"byteLength":24,"byteStride":8}],"buffers":[{"byteLength":24}]})";
  const TemporaryFolder folder;
  const auto asset = test::import_surface(folder.write("q.glb", glb(json, shorts)));
  ASSERT_TRUE(asset) << asset.error().message;
  EXPECT_EQ(asset->surface.bounds().lower, vec3(0, -2, 0));
  EXPECT_EQ(asset->surface.bounds().upper, vec3(2, 0, 0));
}

TEST(ImportGltf, OneMeshComesInItsOwnSpaceAllNodesInTheWorld) {
  const std::string json = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0,1]}],
      "nodes":[{"mesh":0,"translation":[10,0,0]},{"mesh":0,"scale":[3,3,-3]}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
      "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";
  const TemporaryFolder folder;
  const auto file = folder.write("i.glb", glb(json, raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 1})));
  const auto one = test::import_surface(file, {0}), all = test::import_surface(file),
             none = test::import_surface(file, {1});
  ASSERT_TRUE(one && all);
  EXPECT_EQ(one->surface.triangles.size(), 1u);
  EXPECT_EQ(one->surface.bounds().upper, vec3(1, 1, 1));
  EXPECT_EQ(all->surface.triangles.size(), 2u);
  EXPECT_EQ(all->surface.bounds().upper, vec3(11, 3, 1));
  EXPECT_EQ(all->surface.bounds().lower, vec3(0, 0, -3));
  EXPECT_NE(one->source_hash, all->source_hash);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::InvalidArgument);
}

TEST(ImportGltf, CountsWithoutBytesBehindThemAllocateNothing) {
  const TemporaryFolder folder;
  // two sparse accessors that promise 4e9 zeros, and 1.8e19 of them
  for (const char* count : {"4000000000", "18446744073709551615"}) {
    const std::string json =
        fmt::format(R"({{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"componentType":5126,"count":{},"type":"VEC3","sparse":{{"count":1,
        "indices":{{"bufferView":0,"componentType":5125}},"values":{{"bufferView":0}}}}}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36}}]}})",
                    count);
    EXPECT_FALSE(test::import_surface(folder.write("lie.glb", glb(json, std::string(36, '\0')))));
  }
}

// ---- every format

TEST(Import, UnknownKindsAreRefusedByName) {
  const TemporaryFolder folder;
  for (const char* name : {"scene.fbx", "cloud.vdb", "cloud.nvdb.gz", "noextension"}) {
    const auto asset = test::import_surface(folder.write(name, "whatever"));
    ASSERT_FALSE(asset);
    EXPECT_EQ(asset.error().code, ErrorCode::Unsupported);
    EXPECT_NE(asset.error().message.find(name), std::string::npos);
  }
  EXPECT_EQ(test::import_surface(folder.path() / "missing.obj").error().code, ErrorCode::NotFound);
  EXPECT_EQ(test::import_surface(folder.write("a.obj", std::string(kQuadObj) + "f 1 2 3"), {0}).error().code,
            ErrorCode::InvalidArgument);
}

TEST(Import, SizesThatSinglePrecisionCannotHoldAreRefusedWithTheRemedy) {
  const TemporaryFolder folder;
  for (const char* size : {"1e-30", "1e30", "1e300"}) {
    const auto asset =
        test::import_surface(folder.write("a.obj", fmt::format("v 0 0 0\nv {0} 0 0\nv 0 {0} 0\nf 1 2 3\n", size)));
    ASSERT_FALSE(asset) << size;
    EXPECT_EQ(asset.error().code, ErrorCode::Unsupported);
    EXPECT_NE(asset.error().message.find("scale it"), std::string::npos);
  }
}

/// Small valid files of each format, for the hostile tests.
std::vector<std::pair<std::string, std::string>> valid_files() {
  const fs::path nasty = fs::path(FARFIELD_TEST_DATA) / "nasty";
  std::vector<std::pair<std::string, std::string>> out;
  for (const char* name :
       {"ok_quad.glb", "sparse_accessor.glb", "ascii_extra_properties.ply", "crlf_continuation.obj"}) {
    std::ifstream in(nasty / name, std::ios::binary);
    out.emplace_back(name, std::string(std::istreambuf_iterator<char>(in), {}));
  }
  std::string ply = std::string("ply\nformat binary_little_endian 1.0\n") + kPlyVertex + kPlyFace + "end_header\n";
  ply += raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}) + "\x03" + raw<int32_t>({0, 1, 2});
  out.emplace_back("binary.ply", ply);
  return out;
}

TEST(Import, EveryTruncationLoadsOrFailsButNeverCrashes) {
  const TemporaryFolder folder;
  for (const auto& [name, content] : valid_files()) {
    ASSERT_TRUE(test::import_surface(folder.write(name, content))) << name;
    for (size_t length = 0; length < content.size(); ++length)
      test::import_surface(folder.write(name, content.substr(0, length)));
  }
}

TEST(Import, FlippedBytesLoadOrFailButNeverCrash) {
  const TemporaryFolder folder;
  std::mt19937 rng(13);
  for (const auto& [name, content] : valid_files()) {
    for (int run = 0; run < 400; ++run) {
      std::string broken = content;
      for (int flips = 1 + run % 4; flips > 0; --flips) broken[rng() % broken.size()] = static_cast<char>(rng());
      const auto asset = test::import_surface(folder.write(name, broken));
      if (!asset) continue;
      for (const vec3& p : asset->surface.positions) ASSERT_TRUE(is_finite(p)) << name << " run " << run;
    }
  }
}

TEST(ImportObj, CagesBecomeFacesThatKnowTheirFaceOfTheFile) {
  const TemporaryFolder folder;
  const auto file = folder.write("fold.obj", std::string(kQuadObj) + "v 0 0 1\nv 1 0 1\nf 1 2 3 4\nf 2 1 5 6\n");
  ImportOptions options;
  options.subdivision.scheme = SubdivisionScheme::CatmullClark;
  const auto asset = import_asset(file, options);
  ASSERT_TRUE(asset) << asset.error().message;
  const SourceSurface& surface = asset->source;
  EXPECT_GT(surface.triangles.size(), 100u);
  EXPECT_EQ(surface.corner_normal.size(), 3 * surface.triangles.size());
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const vec3 middle = (surface.positions[surface.triangles[t].x] + surface.positions[surface.triangles[t].y] +
                         surface.positions[surface.triangles[t].z]) /
                        3.0f;
    EXPECT_EQ(surface.source_face[t], middle.y > middle.z ? 0u : 1u);
  }
  EXPECT_NE(asset->source_hash, import_asset(file)->source_hash);
}

}  // namespace
}  // namespace farfield
