// SPDX-License-Identifier: Apache-2.0
// Traits of exporters from a list of our own: docs/import_traits.md says for each what is right and where it comes
// from.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "import/read_source.h"
#include "tests/support/files.h"
#include "tests/support/gltf_files.h"
#include "tests/support/png_files.h"

namespace farfield {
namespace {

using namespace test;

namespace fs = std::filesystem;

const fs::path kImages = fs::path(FARFIELD_TEST_DATA) / "import_traits";
const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
const std::string kQuadPly = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

SourceMesh read(const fs::path& file) {
  auto mesh = read_source(file);
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh ? std::move(*mesh) : SourceMesh{};
}

SourceMesh read_text(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  return read(folder.write(name, text));
}

std::string refusal(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  const auto mesh = read_source(folder.write(name, text));
  return mesh ? "" : mesh.error().message;
}

std::string said(const SourceMesh& mesh) { return fmt::format("{}", fmt::join(mesh.warnings, "\n")); }

void expect_said(const SourceMesh& mesh, const std::string& what) {
  EXPECT_NE(said(mesh).find(what), std::string::npos) << said(mesh);
}

std::string red_png() { return png(1, 1, {{255, 0, 0, 255}}); }

// ---- OBJ

TEST(ObjTraits, FacesCountBackFromTheLatestInEveryList) {
  const SourceMesh mesh =
      read_text("a.obj", kTriangle + "vn 0 0 1\nf -3/-3/-1 -2/-2/-1 -1/-1/-1\n" + kTriangle + "f -3/-3 -2/-2 -1/-1\n");
  EXPECT_EQ(mesh.corner_position, (std::vector<uint32_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(mesh.corner_normal[2], vec3(0, 0, 1));
  EXPECT_EQ(mesh.corner_normal[3], vec3(0.0f));
  EXPECT_EQ(said(mesh), "");
}

TEST(ObjTraits, LineEndsOfOldMacs) {
  std::string text = kTriangle + "f 1 2 3\n";
  std::replace(text.begin(), text.end(), '\n', '\r');
  const SourceMesh mesh = read_text("a.obj", text);
  EXPECT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.face_count(), 1u);
}

TEST(ObjTraits, TabsAndLineEndsOfWindowsAndContinuedLines) {
  const SourceMesh mesh = read_text("a.obj", "v\t0 0 0\r\nv 1\t0 \\\r\n 0\r\nv 0 1 0 \r\nf\t1 2 \\\r\n\t3\r\n");
  EXPECT_EQ(mesh.positions[1], dvec3(1, 0, 0));
  EXPECT_EQ(mesh.corner_position, (std::vector<uint32_t>{0, 1, 2}));
}

TEST(ObjTraits, ColoursOfScannersGoTo255) {
  const SourceMesh mesh = read_text("a.obj", "v 0 0 0 255 0 0\nv 1 0 0 255 0 0\nv 0 1 0 128 0 0\nf 1 2 3\n");
  EXPECT_NEAR(mesh.corner_color[0].x, 1, 1e-6);
  EXPECT_NEAR(mesh.corner_color[2].x, srgb_to_linear(128.0f / 255), 1e-6);
  expect_said(mesh, "0 .. 255");
}

TEST(ObjTraits, PaintOfZBrush) {
  const SourceMesh mesh = read_text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff0000ff00ff00ff0000ff\nf 1 2 3\n");
  ASSERT_EQ(mesh.corner_color.size(), 3u);
  EXPECT_EQ(vec3(mesh.corner_color[0]), vec3(1, 0, 0));
  EXPECT_EQ(vec3(mesh.corner_color[2]), vec3(0, 0, 1));
  EXPECT_EQ(mesh.materials[0].base_color, vec3(1.0f));
  // Broken paint, and more of it than there are vertices, does no harm.
  EXPECT_TRUE(read_text("a.obj", kTriangle + "#MRGB xyz\n#MRGB 12345678zz\nf 1 2 3\n").face_count() == 1);
  EXPECT_EQ(read_text("a.obj", "#MRGB ffffffffffffffff\n" + kTriangle + "f 1 2 3\n").corner_color.size(), 0u);
}

TEST(ObjTraits, AFourthCoordinateIsNoColour) {
  const SourceMesh mesh = read_text("a.obj", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n");
  EXPECT_EQ(mesh.positions[1], dvec3(1, 0, 0));
  EXPECT_TRUE(mesh.corner_color.empty());
}

TEST(ObjTraits, DecimalCommasAreSaid) {
  const SourceMesh mesh = read_text("a.obj", "v 0 0 0\nv 1,5 0,5 0\nv 0 1,0 0\nv 0 0 1\nf 1 2 3\n");
  expect_said(mesh, "line 2: v without three numbers (a decimal comma?), 2 such lines");
}

TEST(ObjTraits, Utf16IsRefusedByName) {
  EXPECT_NE(refusal("a.obj", std::string("\xff\xfev\0 \0", 6)).find("UTF-16"), std::string::npos);
}

TEST(ObjTraits, FacesUnderTheirOldKeyword) { EXPECT_EQ(read_text("a.obj", kTriangle + "fo 1 2 3\n").face_count(), 1u); }

TEST(ObjTraits, NamesInCapitalsAreFoundAndGroupsChangeNothing) {
  const SourceMesh mesh = read_text("A.OBJ", "o ship\ng hull deck\ns off\n" + kTriangle + "f 1 2 3\ng\nf 1 2 3\n");
  EXPECT_EQ(mesh.face_count(), 2u);
  EXPECT_EQ(said(mesh), "");
}

/// A triangle whose material the MTL text gives; red.png lies beside it.
SourceMesh read_with_mtl(const std::string& usemtl, const std::string& mtllib, const std::string& mtl) {
  const TemporaryFolder folder;
  folder.write("red.png", red_png());
  folder.write("ship.mtl", mtl);
  return read(folder.write("a.obj", fmt::format("mtllib {}\n{}usemtl {}\nf 1/1 2/2 3/3\n", mtllib, kTriangle, usemtl)));
}

TEST(MtlTraits, LibrariesWithPathsOfWindows) {
  const SourceMesh mesh = read_with_mtl("hull", "C:\\export\\ship.mtl", "newmtl hull\nKd 1 0 0\n");
  EXPECT_EQ(mesh.materials[0].base_color, vec3(1, 0, 0));
  expect_said(mesh, "is taken");
  EXPECT_EQ(said(read_with_mtl("hull", ".\\ship.mtl", "newmtl hull\nKd 1 0 0\n")), "");
}

TEST(MtlTraits, NamesThatDifferInCaseAreTakenAndSaid) {
  const SourceMesh material = read_with_mtl("Hull", "ship.mtl", "newmtl HULL\nKd 1 0 0\n");
  EXPECT_EQ(material.materials[0].base_color, vec3(1, 0, 0));
  expect_said(material, "material Hull is taken for HULL");
  const SourceMesh library = read_with_mtl("hull", "Ship.MTL", "newmtl hull\nKd 1 0 0\n");
  EXPECT_EQ(library.materials[0].base_color, vec3(1, 0, 0));
  const SourceMesh image = read_with_mtl("hull", "ship.mtl", "newmtl hull\nmap_Kd Red.PNG\n");
  EXPECT_TRUE(image.materials[0].base_color_map);
  expect_said(image, "red.png is taken");
}

TEST(MtlTraits, NamesWithBlanksAndBlanksBehindThem) {
  const SourceMesh mesh = read_with_mtl("the hull \t", "ship.mtl", "newmtl the hull  \r\n\tKd\t1 0 0\r\n");
  EXPECT_EQ(mesh.materials[0].base_color, vec3(1, 0, 0));
  EXPECT_EQ(mesh.materials[0].name, "the hull");
  EXPECT_EQ(said(mesh), "");
}

TEST(MtlTraits, TexturesByAbsolutePathsOfAnotherComputer) {
  for (const char* path : {"/Users/me/red.png", "\\\\server\\share\\red.png", "D:/tex/red.png", ".\\red.png"}) {
    EXPECT_TRUE(read_with_mtl("m", "ship.mtl", fmt::format("newmtl m\nmap_Kd {}\n", path)).materials[0].base_color_map)
        << path;
  }
}

TEST(MtlTraits, NamesThatNoFileSystemTakesAreMissing) {
  const SourceMesh mesh = read_with_mtl(
      "m", "ship.mtl", "newmtl m\nmap_Kd " + std::string(5000, 'x') + "/" + std::string(5000, 'y') + "\n");
  EXPECT_FALSE(mesh.materials[0].base_color_map);
  expect_said(mesh, "the plain colour is used");
  expect_said(read_with_mtl("m", std::string(5000, 'x'), ""), "cannot be read");
}

TEST(MtlTraits, LineEndsOfOldMacs) {
  EXPECT_EQ(read_with_mtl("m", "ship.mtl", "newmtl m\rKd 1 0 0\r").materials[0].base_color, vec3(1, 0, 0));
}

/// The mean of a texture that an MTL names, which lies among the images of these tests.
SourceMaterial with_image(const char* lines, const char* image) {
  const TemporaryFolder folder;
  fs::copy(kImages / image, folder.path() / image);
  folder.write("m.mtl", fmt::format("newmtl m\n{} {}\n", lines, image));
  return read(folder.write("a.obj", "mtllib m.mtl\n" + kTriangle + "usemtl m\nf 1/1 2/2 3/3\n")).materials[0];
}

TEST(MtlTraits, ImagesOf16Bits) {
  const SourceMaterial material = with_image("map_Pr", "grey16.png");
  ASSERT_TRUE(material.metallic_roughness_map);
  EXPECT_NEAR(material.metallic_roughness_map.image->mean().y, (0x8000 / 65535.0 + 1) / 2, 1e-4);
}

TEST(MtlTraits, PalettesWithTransparentEntriesAreMasks) {
  const SourceMaterial material = with_image("map_Kd", "palette_alpha.png");
  ASSERT_TRUE(material.base_color_map);
  EXPECT_EQ(material.alpha_mode, AlphaMode::Mask);
  EXPECT_LT(glm::length(material.base_color_map.image->mean() - vec4(0.5f, 0, 0, 0.5f)), 1e-4f);
}

// ---- PLY

TEST(PlyTraits, TriangleStripsOfStanford) {
  const SourceMesh mesh =
      read_text("a.ply",
                "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" +
                    kQuadPly + "8 0 1 3 2 -1 0 1 2\n");
  EXPECT_EQ(mesh.corner_position, (std::vector<uint32_t>{0, 1, 3, 1, 2, 3, 0, 1, 2}));
  const auto bad =
      refusal("a.ply",
              "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty "
              "float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n3 0 0 9\n");
  EXPECT_NE(bad.find("vertex index 9"), std::string::npos) << bad;
}

TEST(PlyTraits, ListsWithCountsAndIndicesOfAnyType) {
  for (const char* types : {"uchar uchar", "uint8 uint16", "ushort int", "int32 uint32", "uint short", "char int"}) {
    const SourceMesh mesh = read_text(
        "a.ply", fmt::format("ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty "
                             "double z\nelement face 1\nproperty list {} vertex_index\nend_header\n{}4 0 1 2 3\n",
                             types, kQuadPly));
    EXPECT_EQ(mesh.corner_count(), 4u) << types;
  }
}

TEST(PlyTraits, BinaryBehindAHeaderWithLineEndsOfWindows) {
  const std::string header =
      "ply\r\nformat binary_little_endian 1.0\r\nobj_info made here\r\nelement vertex 3\r\nproperty float "
      "x\r\nproperty "
      "float y\r\nproperty float z\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n";
  const SourceMesh mesh =
      read_text("a.ply", header + raw<float>({0, 0, 0, 1, 0, 0, 0, 10, 0}) + "\3" + raw<int32_t>({0, 1, 2}));
  EXPECT_EQ(mesh.positions[2], dvec3(0, 10, 0));
  EXPECT_EQ(said(mesh), "");
}

TEST(PlyTraits, PointCloudsAndSplatsAreSaidInOneLine) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  std::string values = "0 0 0";
  for (int i = 0; i < 20; ++i) text += fmt::format("property float f_rest_{}\n", i), values += " 0";
  const SourceMesh mesh = read_text("a.ply", text + "end_header\n" + values + "\n");
  ASSERT_EQ(mesh.warnings.size(), 2u);
  expect_said(mesh, "1 points without faces");
  expect_said(mesh, "and 12 more: ignored");
}

TEST(PlyTraits, EdgesBesideFacesAreSaid) {
  const SourceMesh mesh = read_text(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement "
      "face 1\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int vertex1\nproperty int "
      "vertex2\nend_header\n" +
          kQuadPly + "3 0 1 2\n0 1\n");
  EXPECT_EQ(mesh.face_count(), 1u);
  expect_said(mesh, "1 of 'edge': ignored");
}

TEST(PlyTraits, TwoListsOfFacesOfWhichOneHasColours) {
  const SourceMesh mesh = read_text(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement "
      "face 1\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar "
      "blue\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n" +
          kQuadPly + "3 0 1 2 255 0 0\n3 0 1 2\n3 0 2 3\n");
  EXPECT_EQ(mesh.face_count(), 3u);
  EXPECT_TRUE(mesh.corner_color.empty() || mesh.corner_color.size() == mesh.corner_count());
}

// ---- glTF

/// A .gltf of one primitive; `binary` is its only buffer, in the way that `uri` says.
std::string gltf(const std::string& attributes, const std::string& accessors, const std::string& views,
                 const std::string& uri, size_t bytes, const std::string& members = "") {
  return fmt::format(
      R"({{"asset":{{"version":"2.0"}},"meshes":[{{"primitives":[{{"attributes":{{{}}},"material":0}}]}}],
      "nodes":[{{"mesh":0}}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"uri":"{}","byteLength":{}}}]{}}})",
      attributes, accessors, views, uri, bytes, members.empty() ? R"(,"materials":[{}])" : "," + members);
}

const std::string kPositions = R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"})";
const std::string kView36 = R"({"buffer":0,"byteLength":36})";
const std::string kBytes36 = raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});

TEST(GltfTraits, BuffersAndImagesInsideTheTextAndWithPercentSigns) {
  const TemporaryFolder folder;
  folder.write("my data#1.bin", kBytes36);
  folder.write("red paint.png", red_png());
  const std::string textured =
      R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],
         "images":[{"uri":"red%20paint.png"}])";
  const SourceMesh mesh =
      read(folder.write("a.gltf", gltf(R"("POSITION":0)", kPositions, kView36, "my%20data%231.bin", 36, textured)));
  EXPECT_EQ(mesh.positions[1], dvec3(1, 0, 0));
  ASSERT_TRUE(mesh.materials[0].base_color_map);
  EXPECT_NEAR(mesh.materials[0].base_color_map.image->mean().x, 1, 1e-4);
  const SourceMesh inside = read_text(
      "b.gltf", gltf(R"("POSITION":0)", kPositions, kView36,
                     "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA", 36));
  EXPECT_EQ(inside.positions[2], dvec3(0, 1, 0));
}

TEST(GltfTraits, AByteOrderMarkBeforeTheText) {
  const TemporaryFolder folder;
  folder.write("a.bin", kBytes36);
  const SourceMesh mesh =
      read(folder.write("a.gltf", "\xef\xbb\xbf" + gltf(R"("POSITION":0)", kPositions, kView36, "a.bin", 36)));
  EXPECT_EQ(mesh.face_count(), 1u);
}

TEST(GltfTraits, InterleavedBuffersAndIntegersForCoordinatesColoursAndNormals) {
  // Per vertex, 32 bytes: position, normal as bytes, colour as bytes, texture coordinates as shorts.
  std::string vertices;
  for (int v = 0; v < 3; ++v) {
    vertices += raw<float>({v == 1 ? 1.0f : 0.0f, v == 2 ? 1.0f : 0.0f, 0});
    vertices += raw<int8_t>({0, 0, 127, 0}) + raw<uint8_t>({255, 0, 51, 255}) + raw<uint16_t>({65535, 0}) +
                std::string(8, '\0');
  }
  const TemporaryFolder folder;
  folder.write("a.bin", vertices);
  folder.write("red.png", red_png());
  const auto accessor = [](int offset, int type, const char* shape, bool normalized) {
    return fmt::format(R"({{"bufferView":0,"byteOffset":{},"componentType":{},"count":3,"type":"{}","normalized":{}}})",
                       offset, type, shape, normalized);
  };
  const SourceMesh mesh = read(folder.write(
      "a.gltf", gltf(R"("POSITION":0,"NORMAL":1,"COLOR_0":2,"TEXCOORD_0":3)",
                     fmt::format("{},{},{},{}", accessor(0, 5126, "VEC3", false), accessor(12, 5120, "VEC3", true),
                                 accessor(16, 5121, "VEC4", true), accessor(20, 5123, "VEC2", true)),
                     R"({"buffer":0,"byteLength":96,"byteStride":32})", "a.bin", 96,
                     R"("extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],
              "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],
              "images":[{"uri":"red.png"}])")));
  ASSERT_EQ(mesh.corner_count(), 3u);
  EXPECT_EQ(mesh.positions[2], dvec3(0, 1, 0));
  EXPECT_EQ(mesh.corner_normal[1], vec3(0, 0, 1));
  EXPECT_NEAR(mesh.corner_color[1].z, 0.2f, 1e-6);
  EXPECT_EQ(mesh.corner_uv[0], vec2(1, 0));
  EXPECT_EQ(said(mesh), "");
}

TEST(GltfTraits, TheSecondSetOfCoordinatesAndMapsThatDiffer) {
  const TemporaryFolder folder;
  folder.write("a.bin", kBytes36 + raw<float>({0, 0, 0, 0, 0, 0}) + raw<float>({0.5f, 0.25f, 1, 0, 0, 1}));
  folder.write("red.png", red_png());
  const std::string accessors = kPositions +
                                R"(,{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"},
                                    {"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"})";
  const std::string views =
      kView36 + R"(,{"buffer":0,"byteOffset":36,"byteLength":24},{"buffer":0,"byteOffset":60,"byteLength":24})";
  const SourceMesh mesh = read(folder.write(
      "a.gltf",
      gltf(R"("POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2)", accessors, views, "a.bin", 84,
           R"("materials":[{"name":"hull","pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}},
                        "normalTexture":{"index":0}}],"textures":[{"source":0}],"images":[{"uri":"red.png"}])")));
  ASSERT_EQ(mesh.corner_uv.size(), 3u);
  EXPECT_EQ(mesh.corner_uv[0], vec2(0.5f, 0.25f));
  EXPECT_FALSE(mesh.materials[0].normal_map);
  expect_said(mesh, "material hull: its normal map has texture coordinates of its own");
}

TEST(GltfTraits, MirroredNodesKeepNormalsOutside) {
  const TemporaryFolder folder;
  folder.write("a.bin", kBytes36 + raw<float>({0.6f, 0, 0.8f, 0.6f, 0, 0.8f, 0.6f, 0, 0.8f}));
  std::string text =
      gltf(R"("POSITION":0,"NORMAL":1)",
           kPositions + R"(,{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"})",
           R"({"buffer":0,"byteLength":72})", "a.bin", 72);
  text.replace(text.find(R"({"mesh":0})"), 10, R"({"mesh":0,"scale":[-2,1,1]})");
  const SourceMesh mesh = read(folder.write("a.gltf", text));
  ASSERT_EQ(mesh.corner_normal.size(), 3u);
  EXPECT_LT(glm::length(mesh.corner_normal[0] - glm::normalize(vec3(-0.3f, 0, 0.8f))), 1e-6f);
}

TEST(GltfTraits, OlderVersionsAreRefusedByName) {
  const std::string why = refusal("a.gltf", R"({"asset":{"version":"1.0"},"meshes":{},"nodes":{},"scenes":{}})");
  EXPECT_NE(why.find("glTF 1.0; convert it"), std::string::npos) << why;
}

TEST(GltfTraits, CompressionIsRefusedByName) {
  for (const char* name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}) {
    const std::string why = refusal(
        "a.gltf",
        fmt::format(R"({{"asset":{{"version":"2.0"}},"extensionsUsed":["{0}"],"extensionsRequired":["{0}"]}})", name));
    EXPECT_NE(why.find(name), std::string::npos) << why;
  }
}

TEST(Traits, OtherFormatsAreRefusedByName) {
  for (const char* name : {"a.fbx", "a.stl", "a.usdz", "a.dae", "a.abc"}) {
    EXPECT_NE(refusal(name, "anything").find("OBJ, PLY, glTF"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace farfield
