// SPDX-License-Identifier: Apache-2.0
// The `farfield` command as people and scripts use it: help, errors, the whole road on a small asset, Ctrl-C.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/gltf_files.h"
#include "tests/support/png_files.h"
#include "tests/support/small_assets.h"
#include "tests/support/subprocess.h"
#include "tests/support/vdb_files.h"

namespace farfield {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

ProcessOutput farfield(std::vector<std::string> arguments, const std::function<bool()>& interrupt_when = {}) {
  arguments.insert(arguments.begin(), FARFIELD_TOOL);
  return run_process(arguments, interrupt_when);
}

/// The folder of this process: ctest runs every test in its own, several at once.
fs::path test_folder() { return fs::path(testing::TempDir()) / ("farfield_cli_test_" + std::to_string(getpid())); }

fs::path fresh_folder(const std::string& name) {
  const fs::path folder = test_folder() / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

/// Keeps the evidence of a failure, removes the rest.
class CleanUp : public testing::Environment {
  void TearDown() override {
    std::error_code ignored;
    if (!testing::UnitTest::GetInstance()->Failed()) fs::remove_all(test_folder(), ignored);
  }
};
const auto* const kCleanUp = testing::AddGlobalTestEnvironment(new CleanUp);

std::string contents(const fs::path& path) {
  std::stringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

/// What follows the warnings at the start.
std::string without_warnings(std::string text) {
  for (size_t end; (end = text.find('\n')) != std::string::npos;) {
    if (text.substr(0, end).find(": warning: ") == std::string::npos) break;
    text.erase(0, end + 1);
  }
  return text;
}

/// Failed, with exactly one line on standard error that names the command and has `part`, and nothing else said but
/// warnings that came before.
void expect_one_line_error(ProcessOutput output, const std::string& part) {
  output.err = without_warnings(output.err);
  EXPECT_NE(output.exit_code, 0);
  EXPECT_LT(output.exit_code, 128) << "killed by a signal";
  EXPECT_EQ(output.out, "");
  EXPECT_EQ(std::count(output.err.begin(), output.err.end(), '\n'), 1) << output.err;
  EXPECT_EQ(output.err.rfind("farfield", 0), 0u) << output.err;
  EXPECT_NE(output.err.find(part), std::string::npos) << output.err << "lacks: " << part;
}

void expect_quiet_success(const ProcessOutput& output) {
  EXPECT_EQ(output.exit_code, 0);
  EXPECT_EQ(output.out, "");
  EXPECT_EQ(output.err, "");
}

const std::vector<std::string> kCommands = {"bake",   "info", "verify", "evaluate", "export",
                                            "render", "shot", "trade",  "sky",      "analyse"};

TEST(Help, OfEveryCommandHasAnExampleAndEveryFlagOfTheContract) {
  const std::vector<std::vector<std::string>> flags = {
      {"--output", "--finest-grid", "--coarsest-grid", "--threads", "--report", "--mesh", "--node", "--scene",
       "--assemblies", "--tile-triangles", "--tile", "--source-only"},
      {"--json", "--mesh", "--node", "--tile"},
      {},
      {"--source", "--other-source", "--levels", "--views", "--spp", "--json", "--sheet", "--images"},
      {"--level", "--output", "--report"},
      {"--frame", "--size", "--spp", "--budget", "--assets", "--blend", "--pixel-error", "--full-detail", "--output"},
      {"--frames", "--size", "--spp", "--budget", "--assets", "--blend", "--pixel-error", "--full-detail", "--output"},
      {"--frames", "--size", "--spp", "--budget", "--assets", "--pixel-error", "--rays-per-voxel", "--finest-grid",
       "--no-turned-sun", "--output"},
      {"--output", "--width"},
      {"--output", "--json", "--compare", "--finest-grid", "--subdivide", "--view", "--size"}};
  for (size_t i = 0; i < kCommands.size(); ++i) {
    const ProcessOutput help = farfield({kCommands[i], "--help"});
    EXPECT_EQ(help.exit_code, 0) << kCommands[i];
    EXPECT_EQ(help.err, "");
    EXPECT_NE(help.out.find("Example:\n  farfield " + kCommands[i]), std::string::npos) << help.out;
    for (const std::string& flag : flags[i]) EXPECT_NE(help.out.find(flag), std::string::npos) << flag;
  }
}

TEST(Help, OfTheToolListsTheCommands) {
  const ProcessOutput help = farfield({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const std::string& command : kCommands) EXPECT_NE(help.out.find("  " + command + " "), std::string::npos);
  EXPECT_EQ(farfield({"--version"}).out.rfind("farfield ", 0), 0u);
}

TEST(Usage, NonsenseIsOneLineThatPointsToTheHelp) {
  const std::vector<std::vector<std::string>> nonsense = {
      {},
      {"frobnicate"},
      {"--frobnicate"},
      {"bake"},
      {"bake", "a.obj"},
      {"bake", "a.obj", "-o"},
      {"bake", "a.obj", "-o", "b", "--frobnicate"},
      {"bake", "a.obj", "-o", "b", "--finest-grid", "many"},
      {"bake", "a.obj", "-o", "b", "--finest-grid", "-8"},
      {"bake", "a.obj", "-o", "b", "--threads", "-1"},
      {"bake", "a.obj", "-o", "b", "--mesh", "-2"},
      {"bake", "a.glb", "-o", "b", "--mesh", "2", "--scene"},
      {"bake", "a.glb", "-o", "b", "--assemblies", "all"},
      {"bake", "a.obj", "-o", "b", "c"},
      {"bake", "a.glb", "-o", "b", "--scene", "--part", "2/2"},
      {"bake", "a.glb", "-o", "b", "--part", "0/2"},
      {"info"},
      {"info", "a", "b"},
      {"verify"},
      {"analyse"},
      {"analyse", "a.obj", "--view", "12"},
      {"analyse", "a.obj", "--size", "8"},
      {"evaluate", "a"},
      {"evaluate", "a", "--source", "b", "--levels", "5-2"},
      {"evaluate", "a", "--source", "b", "--views", "0"},
      {"evaluate", "a", "--source", "b", "--lights", "moon"},
      {"evaluate", "a", "--source", "b", "--spp", "0"},
      {"render", "a.glb"},
      {"render", "a.glb", "-o", "b.exr", "--size", "640"},
      {"render", "a.glb", "-o", "b.exr", "--size", "0x0"},
      {"render", "a.glb", "-o", "b.exr", "--budget", "lots"},
      {"render", "a.glb", "-o", "b.exr", "--budget", "-4G"},
      {"render", "a.glb", "-o", "b.exr", "--blend", "stir"},
      {"render", "a.glb", "-o", "b.exr", "--pixel-error", "0"},
      {"render", "a.glb", "-o", "b.exr", "--pixel-error", "nan"},
      {"render", "a.glb", "-o", "b.exr", "--frame", "-1"},
      {"render", "a.glb", "-o", "b.exr", "--spp", "0"},
      {"render", "a.glb", "-o", "b.exr", "--fps", "0"},
      {"render", "a.glb", "-o", "b.exr", "--no-sky", "--environment", "c.exr"},
      {"shot", "a.glb", "-o", "b"},
      {"shot", "a.glb", "-o", "b", "--frames", "9-1"},
      {"shot", "a.glb", "-o", "b", "--frames", "0-9:0"},
      {"shot", "a.glb", "-o", "b", "--frames", ""},
      {"shot", "a.glb", "-o", "b", "--frames", "0", "--pixel-error", "1,2"},
      {"shot", "a.glb", "-o", "b", "--frames", "0", "--turn-sun", "--environment", "c.exr"},
      {"export", "a", "-o", "b.glb"},
      {"export", "a", "--level", "2"},
      {"export", "a", "--level", "2-3", "-o", "b.vdb"},
      {"export", "a", "--level", "2,2", "-o", "b.vdb"},
      {"trade", "a.glb", "-o", "b"},
      {"trade", "a.glb", "--frames", "0-9"},
      {"trade", "a.glb", "-o", "b", "--frames", "9-1"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--pixel-error", "1,0"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--pixel-error", "1,2,1"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--budget", "2G,lots"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--budget", "2G,"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--finest-grid", "512,100"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--rays-per-voxel", "0"},
      {"trade", "a.glb", "-o", "b", "--frames", "0", "--full-detail"},
  };
  for (const auto& arguments : nonsense) {
    std::string line;
    for (const std::string& argument : arguments) line += argument + " ";
    SCOPED_TRACE(line);
    expect_one_line_error(farfield(arguments), "--help");
  }
}

/// Files that are not what they should be.
TEST(Usage, UnknownWordsAreNamedWithTheNearestKnownOne) {
  const auto says = [](const std::vector<std::string>& arguments, const std::string& line) {
    const ProcessOutput output = farfield(arguments);
    EXPECT_EQ(output.exit_code, 2);
    expect_one_line_error(output, line);
  };
  says({"bkae"}, "farfield: bkae: unknown command; did you mean bake? (see farfield --help)");
  says({"bkae", "a.obj", "-o", "b"}, "bkae: unknown command; did you mean bake?");
  says({"frobnicate"}, "farfield: frobnicate: unknown command (see");
  says({"--verson"}, "farfield: --verson: unknown option; did you mean --version?");
  says({"render", "--bugdet", "300M", "scene.glb", "-o", "a.exr"},
       "farfield render: --bugdet: unknown option; did you mean --budget? (see farfield render --help)");
  says({"render", "scene.glb", "--bugdet=300M"}, "--bugdet: unknown option; did you mean --budget?");
  says({"bake", "--", "-a.obj"}, "--output is required");
  says({"bake", "a.obj", "-o", "b", "--frobnicate"}, "farfield bake: --frobnicate: unknown option (see");
}

class BadInput : public testing::Test {
 protected:
  const fs::path folder = fresh_folder("bad_input");
  const std::string bush = (folder / "bush.obj").string();

  void SetUp() override { test::write_bush_obj(bush, 20); }
  std::string path(const std::string& name) const { return (folder / name).string(); }
};

TEST_F(BadInput, MissingFilesAreNamed) {
  expect_one_line_error(farfield({"bake", path("no.obj"), "-o", path("out.farfield")}), path("no.obj"));
  expect_one_line_error(farfield({"analyse", path("no.obj"), "-o", path("no.png")}), path("no.obj"));
  EXPECT_FALSE(fs::exists(path("no.png")));
  expect_one_line_error(farfield({"info", path("no.farfield")}), path("no.farfield"));
  expect_one_line_error(farfield({"verify", path("no.farfield")}), path("no.farfield"));
  expect_one_line_error(farfield({"evaluate", path("no.farfield"), "--source", bush}), path("no.farfield"));
  expect_one_line_error(farfield({"export", path("no.farfield"), "--level", "1", "-o", path("a.glb")}),
                        path("no.farfield"));
  expect_one_line_error(farfield({"render", path("no.glb"), "-o", path("a.exr")}), path("no.glb"));
  expect_one_line_error(farfield({"shot", path("no.glb"), "--frames", "0-1", "-o", path("shot")}), path("no.glb"));
  expect_one_line_error(farfield({"trade", path("no.glb"), "--frames", "0-1", "-o", path("trade")}), path("no.glb"));
  EXPECT_FALSE(fs::exists(path("out.farfield") + "/manifest.json"));
}

TEST_F(BadInput, BrokenFilesAreNamed) {
  const std::string noise = std::string("\x00\xff\x7f{]", 5) + std::string(1000, '\x80');
  for (const char* name : {"broken.obj", "broken.ply", "broken.glb", "broken.gltf", "broken.obj.gz", "broken.txt"}) {
    write(path(name), noise);
    expect_one_line_error(farfield({"bake", path(name), "-o", path("out.farfield")}), name);
    expect_one_line_error(farfield({"info", path(name)}), name);
  }
  expect_one_line_error(farfield({"render", path("broken.glb"), "-o", path("a.exr")}), "broken.glb");
  write(path("empty.obj"), "");
  expect_one_line_error(farfield({"bake", path("empty.obj"), "-o", path("out.farfield")}), "empty.obj");
}

TEST_F(BadInput, HostileManifestsAreRefusedAndNeverCrash) {
  const fs::path asset = folder / "hostile.farfield";
  fs::create_directories(asset);
  for (const std::string& manifest :
       {std::string(), std::string("{}"), std::string("[]"), std::string("nul"), std::string(100000, '['),
        std::string(R"({"version": 1})"), std::string(R"({"version": 999999999999999999999})"),
        std::string(R"({"version": 1, "levels": [{"file": "../../etc/passwd", "level": 0}]})"),
        std::string(1000, '\0')}) {
    write(asset / "manifest.json", manifest);
    expect_one_line_error(farfield({"info", asset.string()}), "hostile.farfield");
    const ProcessOutput verified = farfield({"verify", asset.string()});
    EXPECT_EQ(verified.exit_code, 1);
    EXPECT_EQ(std::count(verified.err.begin(), verified.err.end(), '\n'), 1) << verified.err;
  }
  fs::remove(asset / "manifest.json");
  fs::create_directories(asset / "manifest.json");  // a folder where a file should be
  expect_one_line_error(farfield({"info", asset.string()}), "hostile.farfield");
}

TEST_F(BadInput, UnwritableOutputIsNamedBeforeAnyWorkIsDone) {
  const std::string report = path("missing/report.json");
  expect_one_line_error(farfield({"bake", bush, "-o", path("out.farfield"), "--report", report}), report);
  EXPECT_FALSE(fs::exists(path("out.farfield")));
  expect_one_line_error(farfield({"bake", bush, "-o", bush}), "bush.obj");
  expect_one_line_error(farfield({"bake", bush, "-o", "/proc/nothing/out.farfield"}), "/proc/nothing");
  expect_one_line_error(farfield({"evaluate", path("a"), "--source", bush, "--sheet", path("no/a.png")}), "no/a.png");
  expect_one_line_error(farfield({"analyse", bush, "-o", path("no/a.png")}), "no/a.png");
  expect_one_line_error(farfield({"analyse", bush, "-o", path("a.exr")}), "a.exr");
  expect_one_line_error(farfield({"render", path("a.glb"), "-o", path("no/a.exr")}), "no/a.exr");
  expect_one_line_error(farfield({"render", path("a.glb"), "-o", "/dev/null"}), "/dev/null");
  expect_one_line_error(farfield({"trade", bush, "--frames", "0", "-o", "/proc/nothing/trade"}), "/proc/nothing");
}

TEST_F(BadInput, GridsThatCannotBeAreRefused) {
  for (const auto& [finest, coarsest] : {std::pair("100", "8"), std::pair("8", "64"), std::pair("0", "0")})
    expect_one_line_error(
        farfield({"bake", bush, "-o", path("out.farfield"), "--finest-grid", finest, "--coarsest-grid", coarsest}),
        "grid");
}

TEST_F(BadInput, ABudgetThatCannotDoSaysWhatWould) {
  test::write_bush_scene(path("scene.gltf"), 60);
  const ProcessOutput output = farfield({"render", path("scene.gltf"), "--size", "8x8", "--spp", "1", "--budget", "1K",
                                         "--finest-grid", "16", "--assets", path("assets"), "-o", path("a.exr")});
  expect_one_line_error(output, "budget");
}

/// A triangle whose base colour is an image.
std::string textured_glb() {
  const std::string points = test::raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}), image = test::png(1, 1, {{255, 0, 0, 255}});
  const Json json = {{"asset", {{"version", "2.0"}}},
                     {"buffers", {{{"byteLength", points.size() + image.size()}}}},
                     {"bufferViews",
                      {{{"buffer", 0}, {"byteLength", points.size()}},
                       {{"buffer", 0}, {"byteOffset", points.size()}, {"byteLength", image.size()}}}},
                     {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}}}},
                     {"images", {{{"bufferView", 1}, {"mimeType", "image/png"}}}},
                     {"textures", {{{"source", 0}}}},
                     {"materials", {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}}},
                     {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"material", 0}}}}}}}};
  return test::glb(json.dump(), points + image);
}

TEST_F(BadInput, WithoutTheTextureModuleOnlyImagesCannotBeRead) {
  write(path("textured.glb"), textured_glb());
  const auto bake = [&](const std::string& source, const std::string& asset) {
    return farfield({"bake", source, "-o", path(asset), "--finest-grid", "16"});
  };
  EXPECT_EQ(bake(path("textured.glb"), "with").exit_code, 0);
  setenv("FARFIELD_MODULE_DIR", path("").c_str(), 1);
  EXPECT_EQ(bake(bush, "plain").exit_code, 0);
  const ProcessOutput textured = bake(path("textured.glb"), "without");
  unsetenv("FARFIELD_MODULE_DIR");
  expect_one_line_error(textured, path("farfield_textures.so"));
  EXPECT_FALSE(fs::exists(path("without")));
}

/// One bake that several tests look at.
class WholeRoad : public testing::Test {
 protected:
  static inline fs::path folder;
  static inline std::string bush, asset;

  static void SetUpTestSuite() {
    folder = fresh_folder("whole_road");
    bush = (folder / "bush.obj").string();
    asset = (folder / "bush.farfield").string();
    test::write_bush_obj(bush, 300);
    const ProcessOutput baked =
        farfield({"bake", bush, "-o", asset, "--finest-grid", "32", "--report", path("bake.json")});
    expect_quiet_success(baked);
  }
  static std::string path(const std::string& name) { return (folder / name).string(); }
};

TEST_F(WholeRoad, TheReportHasEveryLevel) {
  const Json report = Json::parse(contents(path("bake.json")));
  EXPECT_EQ(report["source"], "bush.obj");
  EXPECT_GT(report["total_seconds"], 0.0);
  EXPECT_GE(report["levels"].size(), 3u);
  EXPECT_TRUE(report["warnings"].is_array());
}

TEST_F(WholeRoad, BakingAgainDoesNothing) {
  expect_quiet_success(farfield({"bake", bush, "-o", asset, "--finest-grid", "32", "--report", path("again.json")}));
  EXPECT_EQ(Json::parse(contents(path("again.json")))["up_to_date"], true);
}

TEST_F(WholeRoad, InfoShowsEveryLevel) {
  const ProcessOutput table = farfield({"info", asset});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(table.err, "");
  EXPECT_NE(table.out.find("16^3"), std::string::npos) << table.out;
  const ProcessOutput text = farfield({"info", asset, "--json"});
  const Json info = Json::parse(text.out);
  ASSERT_GE(info["levels"].size(), 3u);
  EXPECT_EQ(info["levels"][0]["level"], 0);
  EXPECT_EQ(info["levels"].back()["grid"], 8);
  for (const Json& level : info["levels"]) {
    EXPECT_GT(level["bytes_disk"], 0);
    EXPECT_GT(level["bytes_resident"], 0);
    EXPECT_GT(level["triangles"].get<int>() + level["voxels"].get<int>(), 0);
  }
}

TEST_F(WholeRoad, InfoOfASourceShowsItsMaterials) {
  const ProcessOutput table = farfield({"info", bush});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(table.err, "");
  EXPECT_NE(table.out.find("not baked"), std::string::npos) << table.out;
  const Json info = Json::parse(farfield({"info", bush, "--json"}).out);
  ASSERT_EQ(info["materials"].size(), 3u);  // bark and two greens
  double share = 0;
  for (const Json& material : info["materials"]) {
    EXPECT_NE(table.out.find(material["name"].get<std::string>()), std::string::npos) << table.out;
    EXPECT_EQ(material["looks_wrong"], Json::array());
    share += material["area_share"].get<double>();
  }
  EXPECT_NEAR(share, 1, 1e-9);
  expect_one_line_error(farfield({"info", asset, "--mesh", "0"}), "--mesh");
}

TEST_F(WholeRoad, InfoOfASourceMarksWhatLooksWrong) {
  write(path("wrong.mtl"), "newmtl ink\nKd 0 0 0\nnewmtl bark\nKd 1 1 1\nmap_Kd bark.png\n");
  write(path("wrong.obj"),
        "mtllib wrong.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "usemtl ink\nf 1/1 2/2 3/3\nusemtl bark\nf 1/1 2/2 4/3\n");
  const ProcessOutput table = farfield({"info", path("wrong.obj")});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_NE(table.out.find("looks wrong: ink: black\n"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("looks wrong: bark: base colour map missing\n"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("warning: "), std::string::npos) << table.out;
  EXPECT_NE(table.err.find("bark.png"), std::string::npos) << table.err;
}

TEST_F(WholeRoad, VerifyAcceptsTheAssetAndFindsABrokenByteInEveryLevel) {
  const ProcessOutput good = farfield({"verify", asset});
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_EQ(good.out, "") << "what levels take here is what the bake has measured";
  EXPECT_EQ(good.err, "");
  const Json info = Json::parse(farfield({"info", asset, "--json"}).out);
  for (const Json& level : info["levels"]) {
    const fs::path broken = folder / "broken.farfield", file = broken / level["file"].get<std::string>();
    fs::remove_all(broken);
    fs::copy(asset, broken, fs::copy_options::recursive);
    std::string bytes = contents(file);
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
    write(file, bytes);
    const ProcessOutput bad = farfield({"verify", broken.string()});
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_NE(bad.out.find(file.filename().string()), std::string::npos) << bad.out;
    EXPECT_EQ(std::count(bad.err.begin(), bad.err.end(), '\n'), 1) << bad.err;
  }
}

TEST_F(WholeRoad, EvaluateMeasuresWritesPicturesAndRecordsErrors) {
  expect_quiet_success(
      farfield({"evaluate", asset, "--source", bush, "--levels", "1-9", "--views", "2", "--spp", "16", "--lights",
                "daylight,behind", "--json", path("e.json"), "--sheet", path("e.png"), "--images", path("images")}));
  const Json evaluation = Json::parse(contents(path("e.json")));
  ASSERT_GE(evaluation["levels"].size(), 2u);
  for (const Json& level : evaluation["levels"]) {
    for (const char* key : {"level", "grid", "resolution", "occlusion_error", "occlusion_rms", "color_error",
                            "color_bias", "triangles", "voxels", "bytes_disk", "bytes_resident"})
      EXPECT_TRUE(level.contains(key)) << key;
    EXPECT_EQ(level["color_bias"].size(), 3u);
    // A bound on nonsense, not on quality: nothing is missing, nothing is twice as large, nothing is black.
    EXPECT_LT(std::abs(level["occlusion_error"].get<double>()), 0.3) << level;
    EXPECT_LT(level["bounds"]["color_error"][0].get<double>(), 0.6) << level;
    ASSERT_EQ(level["lights"].size(), 2u);
    EXPECT_EQ(level["lights"][0]["color_error"], level["color_error"]);
    EXPECT_EQ(level["lights"][1]["light"], "behind");
    for (const Json& light : level["lights"]) EXPECT_EQ(light["views"].size(), 2u);
    EXPECT_LT(std::abs(level["depth"]["camera_mean"].get<double>()), 0.1) << level["depth"];
    for (const Json& bias : level["color_bias"]) EXPECT_LT(std::abs(bias.get<double>()), 0.5) << level;
  }
  const auto pictures = std::distance(fs::directory_iterator(path("images")), {});
  EXPECT_EQ(static_cast<size_t>(pictures), evaluation["levels"].size() * 2 * 2 * 2 + 1);
  EXPECT_TRUE(fs::exists(path("images/level_03_view_01_source.exr")));
  EXPECT_TRUE(fs::exists(path("images/level_03_view_01_behind_level.exr")));
  EXPECT_GT(fs::file_size(path("e.png")), 1000u);

  const Json info = Json::parse(farfield({"info", asset, "--json"}).out);
  EXPECT_EQ(info["levels"][1]["color_error"], evaluation["levels"][0]["color_error"]);  // [0] is the source
}

/// What `farfield info` says of a surface as a whole.
struct SurfaceFigures {
  int64_t triangles = 0;
  double area = 0, albedo = 0;

  explicit SurfaceFigures(const Json& info) : triangles(info["triangles"]), area(info["area"]) {
    double seen = 0;
    for (const Json& m : info["materials"]) {
      const double weight = m["area_share"].get<double>() * m["opacity"].get<double>();
      for (const Json& channel : m["albedo"]) albedo += weight * channel.get<double>() / 3;
      seen += weight;
    }
    albedo /= seen;
  }
};

TEST_F(WholeRoad, ExportedSurfacesAreSourcesWithTheSameFacesAreaAndAlbedo) {
  const Json levels = Json::parse(farfield({"info", asset, "--json"}).out)["levels"];
  const auto level = std::ranges::find_if(levels, [](const Json& l) { return l["level"] > 0 && l["triangles"] > 0; });
  ASSERT_NE(level, levels.end());
  const std::string number = std::to_string((*level)["level"].get<int>());
  std::vector<SurfaceFigures> figures;
  for (const std::string ending : {"glb", "obj", "ply"}) {
    const std::string file = path("level." + ending), again = path(ending + ".farfield");
    const ProcessOutput exported =
        farfield({"export", asset, "--level", number, "-o", file, "--report", path("r.json")});
    EXPECT_EQ(exported.exit_code, 0) << exported.err;
    EXPECT_EQ(without_warnings(exported.err), "");
    const Json report = Json::parse(contents(path("r.json")));
    EXPECT_EQ(report["files"][0], file);
    EXPECT_EQ(report["levels"][0]["faces"], (*level)["triangles"]);
    figures.emplace_back(Json::parse(farfield({"info", file, "--json"}).out));
    EXPECT_EQ(figures.back().triangles, (*level)["triangles"]) << ending;
    EXPECT_EQ(farfield({"bake", file, "-o", again, "--source-only"}).exit_code, 0);
    EXPECT_EQ(Json::parse(farfield({"info", again, "--json"}).out)["levels"][0]["triangles"], (*level)["triangles"]);
  }
  for (const SurfaceFigures& other : figures) {
    EXPECT_NEAR(other.area, figures[0].area, 1e-4 * figures[0].area);
    EXPECT_NEAR(other.albedo, figures[0].albedo, 0.01 * figures[0].albedo);
  }
}

TEST_F(WholeRoad, ExportRefusesWhatItCannotWrite) {
  const auto fails = [&](std::vector<std::string> more, const std::string& words) {
    more.insert(more.begin(), {"export", asset});
    expect_one_line_error(farfield(more), words);
  };
  fails({"--level", "77", "-o", path("a.glb")}, "there is no level 77; it has 0, ");
  fails({"--level", "0", "-o", path("a.stl")}, "must end in .vdb");
  fails({"--level", "0", "-o", path("no/a.glb")}, "no/a.glb");
  fails({"--level", "0", "-o", "/proc/a.obj"}, "/proc/a.obj");
  fails({"--level", "0", "-o", asset + "/a.ply"}, "holds a baked asset");
  fails({"--level", "0", "-o", path("a.ply"), "--report", path("no/r.json")}, "no/r.json");
  fs::create_directories(path("folder.mtl"));
  fails({"--level", "0", "-o", path("folder.obj")}, "folder.mtl");
  for (const char* name : {"a.glb", "a.ply", "folder.obj"}) EXPECT_FALSE(fs::exists(path(name))) << name;
}

TEST_F(WholeRoad, EvaluateGivesTheSameFiguresForAnyNumberOfThreads) {
  std::vector<Json> levels;
  for (const char* threads : {"1", "3"}) {
    expect_quiet_success(farfield({"evaluate", asset, "--source", bush, "--levels", "2", "--views", "1", "--spp", "8",
                                   "--threads", threads, "--json", path("t.json")}));
    levels.push_back(Json::parse(contents(path("t.json")))["levels"]);
    for (Json& level : levels.back()) level.erase("seconds");
  }
  EXPECT_EQ(levels[0], levels[1]);
}

TEST_F(WholeRoad, EvaluateRefusesAnotherSourceUnlessToldTo) {
  test::write_bush_obj(path("other.obj"), 200);
  std::vector<std::string> evaluate = {"evaluate", asset, "--source", path("other.obj"),
                                       "--levels", "3",   "--views",  "1",
                                       "--spp",    "4",   "--json",   path("other.json")};
  const ProcessOutput refused = farfield(evaluate);
  expect_one_line_error(refused, "--other-source");
  expect_one_line_error(refused, asset);
  expect_one_line_error(refused, path("other.obj"));
  EXPECT_FALSE(fs::exists(path("other.json")));

  const std::string manifest = contents(asset + "/manifest.json");
  evaluate.push_back("--other-source");
  const ProcessOutput output = farfield(evaluate);
  EXPECT_EQ(contents(asset + "/manifest.json"), manifest) << "errors against another source were recorded";
  EXPECT_EQ(output.exit_code, 0);
  EXPECT_EQ(output.out, "");
  EXPECT_NE(output.err.find("warning"), std::string::npos) << output.err;
  EXPECT_EQ(Json::parse(contents(path("other.json")))["warnings"].size(), 1u);
}

TEST_F(WholeRoad, EvaluateSaysUnknownWhereNoiseWins) {
  const std::vector<std::string> evaluate = {"evaluate", asset, "--source", bush, "--levels", "0-0",
                                             "--views",  "1",   "--spp",    "4",  "--lights", "daylight"};
  const ProcessOutput output = farfield(evaluate);  // the source against itself
  EXPECT_EQ(output.exit_code, 0) << output.err;
  EXPECT_NE(output.out.find("daylight"), std::string::npos) << output.out;
  EXPECT_NE(output.out.find("unknown, at most"), std::string::npos) << output.out;
  const ProcessOutput info = farfield({"info", asset});
  EXPECT_NE(info.out.find("unknown, at most"), std::string::npos) << info.out;
}

TEST_F(WholeRoad, EvaluateRefusesLevelsThatAreNotThere) {
  expect_one_line_error(farfield({"evaluate", asset, "--source", bush, "--levels", "900"}), "900");
}

TEST_F(WholeRoad, RenderAndShotOfAScene) {
  test::write_bush_scene(path("scene.gltf"), 120);
  const std::vector<std::string> common = {"--size", "48x32",    "--spp",        "4",        "--finest-grid",
                                           "32",     "--assets", path("assets"), "--budget", "64M"};
  std::vector<std::string> render = {"render", path("scene.gltf"), "--frame", "12", "-o", path("frame.exr")};
  render.insert(render.end(), common.begin(), common.end());
  expect_quiet_success(farfield(render));
  EXPECT_GT(fs::file_size(path("frame.exr")), 1000u);
  EXPECT_TRUE(fs::exists(path("frame.png")));

  std::vector<std::string> shot = {"shot", path("scene.gltf"), "--frames", "0-24:8", "-o", path("shot")};
  shot.insert(shot.end(), common.begin(), common.end());
  expect_quiet_success(farfield(shot));
  const Json report = Json::parse(contents(path("shot/shot.json")));
  for (const char* key : {"budget_bytes", "baseline_rss_bytes", "peak_rss_bytes", "peak_accounted_bytes", "frames"})
    EXPECT_TRUE(report.contains(key)) << key;
  ASSERT_EQ(report["frames"].size(), 4u);
  for (const Json& frame : report["frames"])
    for (const char* key : {"frame", "seconds", "load_seconds", "stall_seconds", "stall", "accounted_bytes", "bias"})
      EXPECT_TRUE(frame.contains(key)) << key;
  EXPECT_LE(report["peak_accounted_bytes"], report["budget_bytes"]);
  const std::string fingerprint = report["fingerprint"];
  EXPECT_EQ(fingerprint.rfind("farfield ", 0), 0u) << "does not say which program rendered: " << fingerprint;

  render.insert(render.end(), {"--full-detail"});
  expect_quiet_success(farfield(render));
  const std::string of_whole_asset = contents(path("frame.exr"));
  const auto is_source = [](const fs::path& name) { return name.string().find(".source.") != std::string::npos; };
  for (const auto& entry : fs::directory_iterator(path("assets/scene")))
    EXPECT_FALSE(is_source(entry.path().filename())) << "baked again for its level 0";
  fs::remove_all(path("assets"));
  expect_quiet_success(farfield(render));
  EXPECT_TRUE(std::ranges::all_of(fs::directory_iterator(path("assets/scene")),
                                  [&](const auto& entry) { return is_source(entry.path().filename()); }));
  EXPECT_EQ(contents(path("frame.exr")), of_whole_asset);
}

TEST_F(WholeRoad, WhyAPixelShowsWhatItShows) {
  test::write_bush_scene(path("scene.gltf"), 120);
  const auto ask = [&](const std::vector<std::string>& more) {
    std::vector<std::string> why = {"why",      path("scene.gltf"), "--frame",       "0", "--size", "48x32",
                                    "--assets", path("assets"),     "--finest-grid", "32"};
    why.insert(why.end(), more.begin(), more.end());
    return farfield(why);
  };
  const ProcessOutput near = ask({"--pixel", "14,16", "--json"});
  ASSERT_EQ(near.exit_code, 0) << near.err;
  const Json json = Json::parse(near.out);
  ASSERT_GT(json["visits"].size(), 0u);
  const Json& first = json["visits"][0];
  EXPECT_EQ(first["asset"], "bush");
  EXPECT_GE(first["level"], 0);
  EXPECT_FALSE(first["levels"].empty());
  int rays = 0;
  bool is_seen = false;
  for (const Json& hit : json["hits"]) {
    rays += hit["rays"].get<int>();
    is_seen |= hit["asset"] == "bush" && (hit["level"] == first["level"] || hit["level"] == first["next_level"]);
  }
  EXPECT_EQ(rays, json["rays"]);
  EXPECT_TRUE(is_seen) << json["hits"];

  const ProcessOutput text = ask({"--pixel", "14,16"});
  EXPECT_NE(text.out.find("lambda"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("nothing finer"), std::string::npos) << text.out;
  const ProcessOutput fine = ask({"--pixel", "14,16", "--pixel-error", "0.01", "--json"});
  const uint64_t asked = Json::parse(fine.out)["asked_bytes"];
  const ProcessOutput poor = ask({"--pixel", "14,16", "--pixel-error", "0.01", "--budget", std::to_string(asked - 1)});
  EXPECT_NE(poor.out.find("nothing finer: the budget"), std::string::npos) << poor.out << poor.err;
  EXPECT_NE(ask({"--pixel", "0,0"}).out.find("meets no instance's bounds"), std::string::npos);
  expect_one_line_error(ask({"--pixel", "48,0"}), "48x32");

  const ProcessOutput stats = farfield({"render", path("scene.gltf"), "--size", "24x16", "--spp", "2", "--assets",
                                        path("assets"), "--finest-grid", "32", "--stats", "-o", path("stats.exr")});
  EXPECT_EQ(stats.exit_code, 0);
  EXPECT_NE(stats.out.find("served coarser"), std::string::npos) << stats.out;
  EXPECT_NE(stats.out.find("bush"), std::string::npos) << stats.out;
}

/// A ball of fog, 16 voxels wide, about the origin.
void write_fog_ball(const fs::path& path) {
  test::VdbGrid grid;
  grid.index_to_source = glm::dmat4(glm::dmat3(0.125));
  grid.voxels = test::filled_cube({-8, -8, -8}, 17,
                                  [](const ivec3& v) { return std::max(0.0, 8 - glm::length(dvec3(v) - 8.0)); });
  test::write_vdb(path, {grid});
}

TEST_F(WholeRoad, AVolumeIsBakedJudgedAndRendered) {
  write_fog_ball(path("ball.vdb"));
  const std::vector<std::string> fog = {"--density-scale", "2", "--albedo", "0.9,0.8,0.7", "--anisotropy=-0.3"};
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), fog.begin(), fog.end());
    expect_quiet_success(farfield(arguments));
  };
  const ProcessOutput source = farfield({"info", path("ball.vdb"), "--albedo", "1"});
  EXPECT_NE(source.out.find("voxels with a density in 15 x 15 x 15"), std::string::npos) << source.out;
  EXPECT_EQ(Json::parse(farfield({"info", path("ball.vdb"), "--json"}).out)["dims"], Json({15, 15, 15}));
  run({"bake", path("ball.vdb"), "-o", path("ball.farfield"), "--coarsest-grid", "4"});
  expect_quiet_success(farfield({"verify", path("ball.farfield")}));
  const ProcessOutput info = farfield({"info", path("ball.farfield")});
  EXPECT_NE(info.out.find("15^3"), std::string::npos) << info.out;
  run({"evaluate", path("ball.farfield"), "--source", path("ball.vdb"), "--views", "1", "--spp", "4", "--lights",
       "daylight", "--json", path("ball.json")});
  EXPECT_EQ(Json::parse(contents(path("ball.json")))["levels"].size(), 1u);  // 4^3 voxels save no page against 8^3
  run({"render", path("ball.vdb"), "--assets", path("fog_assets"), "--size", "24x16", "--spp", "4", "-o",
       path("ball.exr")});
  EXPECT_TRUE(fs::exists(path("fog_assets/ball/ball.farfield/manifest.json")));
  EXPECT_GT(fs::file_size(path("ball.exr")), 1000u);
}

TEST_F(WholeRoad, AVolumeStandsInASceneOfMeshes) {
  write_fog_ball(path("ball.vdb"));
  test::write_bush_scene(path("scene.gltf"), 120);
  Json scene = Json::parse(contents(path("scene.gltf")));
  scene["nodes"].push_back({{"name", "fog"},
                            {"translation", {0, 1.5, 2}},
                            {"extras", {{"farfield_volume", {{"file", "ball.vdb"}, {"albedo", {1, 0.2, 0.2}}}}}}});
  scene["scenes"][0]["nodes"].push_back(scene["nodes"].size() - 1);
  std::ofstream(path("foggy.gltf")) << scene;
  const std::vector<std::string> common = {"--finest-grid", "16", "--size",   "48x32",
                                           "--spp",         "8",  "--assets", path("foggy_assets")};
  const auto render = [&](const std::string& file, const std::string& out) {
    std::vector<std::string> arguments = {"render", path(file), "-o", path(out)};
    arguments.insert(arguments.end(), common.begin(), common.end());
    expect_quiet_success(farfield(arguments));
  };
  render("foggy.gltf", "foggy.exr");
  EXPECT_TRUE(fs::exists(path("foggy_assets/foggy/ball.farfield/manifest.json")));
  EXPECT_TRUE(fs::exists(path("foggy_assets/foggy/bush.farfield/manifest.json")));
  render("scene.gltf", "clear.exr");
  EXPECT_NE(contents(path("foggy.png")), contents(path("clear.png")));
  fs::remove(path("ball.vdb"));  // the picture is without it, and says so
  const ProcessOutput without = farfield({"render", path("foggy.gltf"), "-o", path("without.exr"), "--size", "48x32",
                                          "--spp", "8", "--assets", path("foggy_assets"), "--finest-grid", "16"});
  EXPECT_EQ(without.exit_code, 0);
  EXPECT_NE(without.err.find("its volume is left out"), std::string::npos) << without.err;
}

/// Two settings of a scene's bush against full detail, small and fast.
std::vector<std::string> trade_of(const std::string& scene, const std::string& assets, const std::string& out) {
  return {"trade",         scene, "--frames", "0-8:8", "--size",        "24x16", "--spp", "4",
          "--finest-grid", "16",  "--assets", assets,  "--pixel-error", "1,8",   "-o",    out};
}

TEST_F(WholeRoad, TradeMeasuresAndIsNotRenderedAgain) {
  test::write_bush_scene(path("scene.gltf"), 120);
  const std::vector<std::string> trade = trade_of(path("scene.gltf"), path("trade_assets"), path("trade"));
  expect_quiet_success(farfield(trade));
  const std::string first = contents(path("trade/trade.json"));
  const Json json = Json::parse(first);
  EXPECT_EQ(json["frames"], Json({0, 8}));
  ASSERT_EQ(json["settings"].size(), 3u);
  for (const Json& setting : json["settings"]) {
    ASSERT_EQ(setting["lights"].size(), 2u);
    for (const Json& light : setting["lights"]) {
      EXPECT_GT(light["cpu_seconds"], 0.0);
      EXPECT_GT(light["variance"], 0.0);
      EXPECT_GT(light["peak_accounted_bytes"], 1000);
      EXPECT_EQ(light["frames"].size(), 2u);
    }
  }
  const auto variance = [&](size_t light) { return json["settings"][0]["lights"][light]["variance"].get<double>(); };
  EXPECT_NE(variance(0), variance(1)) << "the sun was not turned";
  EXPECT_EQ(json["advice"].size(), 4u);
  const std::string page = contents(path("trade/trade.html"));
  EXPECT_EQ(page.rfind("<!DOCTYPE html>", 0), 0u);
  EXPECT_NE(page.find("data:image/png;base64,iVBORw0KGgo"), std::string::npos) << "no picture";

  // Times of an earlier run come again only if nothing was rendered anew.
  expect_quiet_success(farfield(trade));
  EXPECT_EQ(contents(path("trade/trade.json")), first);
}

TEST_F(WholeRoad, ABudgetThatCannotDoEndsATradeWithTheSettingAndTheReason) {
  test::write_bush_scene(path("scene.gltf"), 120);
  std::vector<std::string> trade = trade_of(path("scene.gltf"), path("trade_assets"), path("trade_small"));
  trade.insert(trade.end(), {"--budget", "64M,1K"});
  const ProcessOutput output = farfield(trade);
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_NE(output.err.find("too small"), std::string::npos) << output.err;
  EXPECT_NE(output.err.find("farfield trade: --budget 1K: "), std::string::npos) << output.err;
  EXPECT_FALSE(fs::exists(path("trade_small/trade.json")));
}

/// A triangle, and a mesh "torn" whose positions reach past the end of their buffer.
void write_scene_with_a_torn_mesh(const fs::path& path) {
  const std::string positions = test::raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
    "nodes":[{"mesh":0},{"mesh":1}],
    "meshes":[{"name":"whole","primitives":[{"attributes":{"POSITION":0}}]},
              {"name":"torn","primitives":[{"attributes":{"POSITION":1}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                 {"bufferView":0,"componentType":5126,"count":300,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";
  write(path, test::glb(json, positions));
}

TEST(Warnings, OfABrokenMeshNameItAndTheSceneIsRendered) {
  const fs::path folder = fresh_folder("torn_mesh");
  const std::string scene = (folder / "scene.glb").string();
  write_scene_with_a_torn_mesh(scene);
  const std::vector<std::string> common = {"--size", "16x16", "--spp", "1", "--finest-grid", "16"};
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), common.begin(), common.end());
    return farfield(arguments);
  };
  const ProcessOutput render = run({"render", scene, "-o", (folder / "frame.exr").string()});
  EXPECT_EQ(render.exit_code, 0) << render.err;
  EXPECT_NE(render.err.find("farfield render: warning: "), std::string::npos) << render.err;
  EXPECT_NE(render.err.find("\"torn\""), std::string::npos) << render.err;

  const ProcessOutput shot = run({"shot", scene, "--frames", "0-1", "-o", (folder / "shot").string()});
  EXPECT_EQ(shot.exit_code, 0) << shot.err;
  EXPECT_NE(shot.err.find("farfield shot: warning: "), std::string::npos) << shot.err;
  const Json report = Json::parse(contents(folder / "shot/shot.json"));
  ASSERT_EQ(report["warnings"].size(), 1u) << report["warnings"];
  EXPECT_NE(report["warnings"][0].get<std::string>().find("\"torn\""), std::string::npos);
}

TEST(SceneBake, SaysOfEachAssetHowItWentAndBakesTheOthers) {
  const fs::path folder = fresh_folder("scene_bake");
  const std::string scene = (folder / "scene.glb").string(), library = (folder / "assets").string();
  write_scene_with_a_torn_mesh(scene);
  const std::string report = (folder / "report.json").string();
  const ProcessOutput bake =
      farfield({"bake", scene, "--scene", "-o", library, "--finest-grid", "16", "--report", report});
  EXPECT_EQ(bake.exit_code, 1);
  EXPECT_EQ(bake.out, "baking whole\nready whole\nbaking torn\nfailed torn\n");
  EXPECT_NE(bake.err.find("farfield bake: warning: torn: "), std::string::npos) << bake.err;
  EXPECT_NE(bake.err.find("1 of its assets cannot be baked"), std::string::npos) << bake.err;
  EXPECT_EQ(farfield({"verify", library + "/whole.farfield"}).exit_code, 0);
  const Json assets = Json::parse(contents(report))["assets"];
  ASSERT_EQ(assets.size(), 1u) << "of what was baked";
  EXPECT_EQ(assets[0]["asset"], "whole");
  EXPECT_GT(assets[0]["cpu_seconds"], 0.0);
  EXPECT_GT(assets[0]["peak_bytes"], 1u << 20);
  EXPECT_FALSE(assets[0]["levels"].empty());
}

TEST(SceneBake, PartsShareTheAssets) {
  const fs::path folder = fresh_folder("scene_parts");
  const std::string scene = (folder / "scene.glb").string(), library = (folder / "assets").string();
  write_scene_with_a_torn_mesh(scene);
  const auto bake = [&](const std::string& part) {
    return farfield({"bake", scene, "--scene", "-o", library, "--finest-grid", "16", "--part", part});
  };
  EXPECT_EQ(bake("0/2").out, "baking whole\nready whole\n");
  EXPECT_EQ(bake("1/2").out, "baking torn\nfailed torn\n");
  EXPECT_EQ(bake("2/3").out, "");
  EXPECT_EQ(bake("2/3").exit_code, 0);
}

/// A task script of scripts/slurm, as number `task`, without Slurm.
ProcessOutput run_task(const std::string& script, int task, std::vector<std::string> arguments) {
  setenv("FARFIELD", FARFIELD_TOOL, 1);
  setenv("FARFIELD_TASK", std::to_string(task).c_str(), 1);
  setenv("FARFIELD_MEMORY_MB", "300", 1);
  arguments.insert(arguments.begin(), FARFIELD_SOURCE_DIR "/scripts/slurm/" + script);
  return run_process(arguments);
}

TEST(Farm, TasksTogetherRenderTheShotWithinTheJobsMemory) {
  const fs::path folder = fresh_folder("farm");
  const std::string scene = (folder / "scene.gltf").string(), assets = (folder / "assets").string();
  test::write_bush_scene(scene, 60);
  const std::vector<std::string> how = {"--finest-grid", "16"};
  for (int task = 0; task < 2; ++task) {
    const ProcessOutput bake = run_task("bake_task", task, {scene, assets, "2", how[0], how[1]});
    EXPECT_EQ(bake.exit_code, 0) << bake.err;
  }
  const std::vector<std::string> picture = {"--assets", assets, "--size", "16x8", "--spp", "1", how[0], how[1]};
  const auto frames = [&](int task, const std::string& range) {
    std::vector<std::string> arguments = {scene, (folder / "frames").string(), range, "2"};
    arguments.insert(arguments.end(), picture.begin(), picture.end());
    return run_task("shot_task", task, arguments);
  };
  for (int task = 0; task < 4; ++task) expect_quiet_success(frames(task, "2-10:2"));  // the fourth has nothing to do

  std::vector<std::string> whole = {"shot",     scene,    "-o",       (folder / "whole").string(),
                                    "--frames", "2-10:2", "--budget", "44M"};
  whole.insert(whole.end(), picture.begin(), picture.end());
  expect_quiet_success(farfield(whole));
  for (const char* frame : {"02", "04", "06", "08", "10"}) {
    const std::string name = std::string("frame_00") + frame + ".exr";
    EXPECT_EQ(contents(folder / "frames" / name), contents(folder / "whole" / name)) << name;
  }
  EXPECT_EQ(Json::parse(contents(folder / "frames/tasks/2/shot.json"))["budget_bytes"], 44 << 20);
  EXPECT_FALSE(fs::exists(folder / "frames/tasks/3"));

  for (const char* range : {"", "5", "9-1:0", "0-9:x"}) {
    const ProcessOutput wrong = frames(0, range);
    EXPECT_EQ(wrong.exit_code, 2) << range;
    EXPECT_EQ(wrong.err.rfind("shot_task: ", 0), 0u) << wrong.err;
  }
}

/// Warnings first, one a line, then the error.
void expect_warning_before_error(const ProcessOutput& output, const std::string& command, const std::string& warning,
                                 const std::string& error) {
  EXPECT_EQ(output.exit_code, 1);
  const size_t warned = output.err.find("farfield " + command + ": warning: " + warning);
  const size_t failed = output.err.find(error);
  EXPECT_NE(warned, std::string::npos) << output.err << "lacks: " << warning;
  EXPECT_NE(failed, std::string::npos) << output.err << "lacks: " << error;
  EXPECT_LT(warned, failed) << output.err;
}

TEST_F(WholeRoad, WhatAFailedImportHadWarnedOfIsSaidWithTheError) {
  const std::string flat = path("flat.obj");
  write(flat, "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  const std::string warning = "material library gone.mtl cannot be read", error = "no face has any area";
  expect_warning_before_error(farfield({"bake", flat, "-o", path("flat.farfield")}), "bake", warning, error);
  expect_warning_before_error(farfield({"info", flat}), "info", warning, error);
  expect_warning_before_error(farfield({"evaluate", asset, "--source", flat}), "evaluate", warning, error);
}

TEST(Warnings, OfAMeshThatCannotBeBakedAreSaidByRenderAndShot) {
  const fs::path folder = fresh_folder("flat_mesh");
  const std::string scene = (folder / "scene.glb").string();
  const std::string json = R"({"asset":{"version":"2.0"},"extensionsUsed":["EXT_of_nobody"],"scene":0,
    "scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,0,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";
  write(scene, test::glb(json, test::raw<float>({0, 0, 0, 1, 0, 0, 2, 0, 0})));
  const std::string error = "no face has any area";
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"render", {"-o", (folder / "frame.exr").string()}},
      {"shot", {"-o", (folder / "shot").string(), "--frames", "0-1"}}};
  for (const auto& [command, rest] : commands) {
    std::vector<std::string> arguments = {command, scene, "--size", "8x8"};
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    const ProcessOutput output = farfield(arguments);
    expect_warning_before_error(output, "bake", "extension EXT_of_nobody is not read", error);
    expect_warning_before_error(output, command, "extension EXT_of_nobody is not read", error);
  }
}

TEST(Analyse, WritesItsFilesAndElsePrintsATable) {
  const fs::path folder = fresh_folder("analyse");
  const std::string bush = (folder / "bush.obj").string(), sheet = (folder / "a.png").string(),
                    json = (folder / "a.json").string();
  test::write_bush_obj(bush, 20);
  const ProcessOutput files = farfield({"analyse", bush, "-o", sheet, "--json", json, "--finest-grid", "16"});
  EXPECT_EQ(files.exit_code, 0) << files.err;
  EXPECT_EQ(files.out, "");
  EXPECT_TRUE(fs::exists(sheet) && fs::exists(json));
  const ProcessOutput table = farfield({"analyse", bush, "--finest-grid", "16"});
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_NE(table.out.find("16^3"), std::string::npos) << table.out << table.err;
}

TEST_F(WholeRoad, TheSkyIsAPictureThatLightsASceneAlike) {
  test::write_bush_scene(path("scene.gltf"), 120);
  expect_quiet_success(farfield({"sky", path("scene.gltf"), "-o", path("sky.exr")}));
  expect_quiet_success(farfield({"sky", "-o", path("default.exr"), "--width", "64"}));
  EXPECT_GT(fs::file_size(path("sky.exr")), fs::file_size(path("default.exr")));
  const ProcessOutput lit =
      farfield({"render", path("scene.gltf"), "--environment", path("default.exr"), "--size", "16x8", "--finest-grid",
                "32", "--assets", path("assets"), "-o", path("lit.exr")});
  EXPECT_EQ(lit.exit_code, 0);
  EXPECT_NE(lit.err.find("replaces the scene's directional lights"), std::string::npos) << lit.err;
  expect_one_line_error(farfield({"sky", path("no.glb"), "-o", path("a.exr")}), path("no.glb"));
  expect_one_line_error(farfield({"sky", "-o", path("a.png")}), ".exr");
}

TEST(Interrupt, ABakeStopsInOrderAndGoesOnLater) {
  const fs::path folder = fresh_folder("interrupt_bake");
  const std::string bush = (folder / "bush.obj").string(), asset = (folder / "bush.farfield").string();
  test::write_bush_obj(bush, 5000);
  const std::vector<std::string> bake = {"bake", bush, "-o", asset, "--finest-grid", "64"};
  // As soon as its working folder is there: the source has been read, no level is done.
  const auto has_started = [&] { return fs::exists(asset + ".partial"); };
  const ProcessOutput interrupted = farfield(bake, has_started);
  EXPECT_EQ(interrupted.exit_code, 130);
  EXPECT_EQ(std::count(interrupted.err.begin(), interrupted.err.end(), '\n'), 1) << interrupted.err;
  EXPECT_FALSE(fs::exists(asset));
  expect_quiet_success(farfield(bake));
  EXPECT_FALSE(fs::exists(asset + ".partial"));
  EXPECT_EQ(farfield({"verify", asset}).exit_code, 0);
}

TEST(Interrupt, ATradeSaysSoOnceAndGoesOnLater) {
  const fs::path folder = fresh_folder("interrupt_trade");
  test::write_bush_scene(folder / "scene.gltf", 60);
  const std::vector<std::string> trade =
      trade_of((folder / "scene.gltf").string(), (folder / "assets").string(), (folder / "trade").string());
  const fs::path first = folder / "trade/renders/full_detail/own_0/shot.json";
  const ProcessOutput interrupted = farfield(trade, [&] { return fs::exists(first); });
  EXPECT_EQ(interrupted.exit_code, 130);
  EXPECT_EQ(interrupted.err, "farfield trade: interrupted\n");
  EXPECT_FALSE(fs::exists(folder / "trade/trade.json"));
  const std::string kept = contents(folder / "trade/renders/full_detail/own_0/frame_0000.exr");
  const auto written = fs::last_write_time(folder / "trade/renders/full_detail/own_0/frame_0000.exr");
  expect_quiet_success(farfield(trade));
  EXPECT_EQ(contents(folder / "trade/renders/full_detail/own_0/frame_0000.exr"), kept);
  EXPECT_EQ(fs::last_write_time(folder / "trade/renders/full_detail/own_0/frame_0000.exr"), written);
  EXPECT_TRUE(fs::exists(folder / "trade/trade.json"));
}

TEST(Interrupt, AShotKeepsItsFrames) {
  const fs::path folder = fresh_folder("interrupt_shot");
  test::write_bush_scene(folder / "scene.gltf", 60);
  const std::vector<std::string> shot = {"shot",
                                         (folder / "scene.gltf").string(),
                                         "--frames",
                                         "0-2000",
                                         "--size",
                                         "32x24",
                                         "--spp",
                                         "4",
                                         "--finest-grid",
                                         "16",
                                         "--assets",
                                         (folder / "assets").string(),
                                         "-o",
                                         (folder / "shot").string()};
  const auto has_frame = [&] { return fs::exists(folder / "shot/frame_0001.exr"); };
  const ProcessOutput interrupted = farfield(shot, has_frame);
  EXPECT_EQ(interrupted.exit_code, 130);
  EXPECT_EQ(std::count(interrupted.err.begin(), interrupted.err.end(), '\n'), 1) << interrupted.err;
  EXPECT_TRUE(fs::exists(folder / "shot/frame_0000.exr"));
  EXPECT_GE(Json::parse(contents(folder / "shot/shot.json"))["frames"].size(), 1u);
}

}  // namespace
}  // namespace farfield
