// SPDX-License-Identifier: Apache-2.0
#include "cache/manifest.h"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/nonfinite.h"
#include "base/random.h"
#include "tests/support/asset_writer.h"
#include "tests/support/files.h"

namespace farfield {
namespace {

using Json = nlohmann::ordered_json;
using test::sample_manifest;
using test::TemporaryFolder;

TEST(Manifest, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  const Manifest manifest = sample_manifest();
  const Result<void> written = write_manifest(folder.path(), manifest);
  ASSERT_TRUE(written) << written.error().message;
  const Result<Manifest> read = read_manifest(folder.path());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(manifest_to_json(*read), manifest_to_json(manifest));
  EXPECT_EQ(read->source_hash, manifest.source_hash);
  EXPECT_EQ(read->source_files, manifest.source_files);
  EXPECT_EQ(read->warnings, manifest.warnings);
  EXPECT_EQ(read->origin, manifest.origin);
  EXPECT_EQ(read->rotation, manifest.rotation);
  EXPECT_EQ(read->bounds.lower, manifest.bounds.lower);
  EXPECT_EQ(read->bounds.upper, manifest.bounds.upper);
  EXPECT_EQ(read->hull, manifest.hull);
  ASSERT_EQ(read->levels.size(), 3u);
  EXPECT_EQ(read->levels[1].file_hash, manifest.levels[1].file_hash);
  EXPECT_EQ(read->levels[1].errors->occlusion_error, -0.01);
  EXPECT_FALSE(read->levels[2].errors);
}

TEST(Manifest, SourceNamesNeedNotBeUtf8) {
  Manifest manifest = sample_manifest();
  manifest.source = "caf\xe9.obj";
  const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->source, "caf\xef\xbf\xbd.obj");
}

TEST(Manifest, ExtremeValuesSurvive) {
  Manifest manifest = sample_manifest();
  manifest.source_hash = ~uint64_t{0};
  manifest.source_files = std::vector<HashedFile>{{"a/b.mtl", 1}, {"../c \"d\".png", 0}};
  manifest.warnings = {"one", "two\n"};
  manifest.origin = {1e300, -1e-300, 0.1};
  manifest.rotation = glm::dmat3(dvec3(0.6, 0.8, 0), dvec3(-0.8, 0.6, 0), dvec3(0, 0, -1));
  manifest.hull = {{1e-45f, 3.4e38f, 0.1f}};
  manifest.levels.resize(1);
  manifest.levels[0].file_bytes = uint64_t{1} << 50;
  manifest.levels[0].errors = LevelErrors{-1.7e308, 5e-324, 0.1};
  const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->source_hash, manifest.source_hash);
  EXPECT_EQ(read->source_files, manifest.source_files);
  EXPECT_EQ(read->warnings, manifest.warnings);
  EXPECT_EQ(read->origin, manifest.origin);
  EXPECT_EQ(read->hull, manifest.hull);
  EXPECT_EQ(read->levels[0].file_bytes, uint64_t{1} << 50);
  EXPECT_EQ(read->levels[0].errors->occlusion_rms.value, 5e-324);
}

TEST(Manifest, ErrorsThatNoiseHidesStayUnknown) {
  Manifest manifest = sample_manifest();
  manifest.levels[1].errors = LevelErrors{-0.01, 0.04, ErrorSize::unknown(0.002, 0.03)};
  const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
  ASSERT_TRUE(read) << read.error().message;
  const LevelErrors& errors = *read->levels[1].errors;
  EXPECT_FALSE(errors.color_error.value);
  EXPECT_EQ(errors.color_error.low, 0.002);
  EXPECT_EQ(errors.color_error.high, 0.03);
  EXPECT_EQ(errors.occlusion_rms.value, 0.04);
  // An unknown error without bounds says nothing at all.
  const Result<Manifest> bare = manifest_from_json(
      [&] {
        auto json = nlohmann::json::parse(manifest_to_json(manifest));
        json["levels"][1]["errors"].erase("color_error_bounds");
        return json.dump();
      }(),
      "test");
  ASSERT_FALSE(bare);
  EXPECT_NE(bare.error().message.find("color_error_bounds"), std::string::npos) << bare.error().message;
}

TEST(Manifest, KeepsWhatMorphsTake) {
  Manifest manifest = sample_manifest();
  manifest.levels[1].morph = LevelCost{70001, 302};
  const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->levels[0].morph);
  ASSERT_TRUE(read->levels[1].morph);
  EXPECT_EQ(read->levels[1].morph->resident_bytes, 70001u);
  EXPECT_EQ(read->levels[1].morph->build_peak_bytes, 302u);
  manifest.levels[1].morph->resident_bytes = uint64_t{1} << 51;
  EXPECT_FALSE(manifest_from_json(manifest_to_json(manifest), "test"));
}

TEST(Manifest, GoldenTextOfVersion1IsFrozen) {
  const Result<Manifest> golden = read_manifest(FARFIELD_TEST_DATA "/format_v1");
  ASSERT_TRUE(golden) << golden.error().message;
  EXPECT_EQ(manifest_to_json(*golden), manifest_to_json(sample_manifest()));
  const auto bytes = test::read_bytes(FARFIELD_TEST_DATA "/format_v1/manifest.json");
  EXPECT_EQ(manifest_to_json(sample_manifest()),
            std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

Manifest textured_manifest() {
  Manifest manifest = sample_manifest();
  manifest.textures.push_back({"texture_0.tif", 1234, 99, 1024, 512, 3, 9000});
  manifest.textures.push_back({"texture_1.tif", 5, 98, 16, 16, 2, 300});
  AssetMaterial& bark = manifest.materials.emplace_back();
  bark.name = "bark \"old\"";
  bark.base_color = {0.1f, 0.2f, 0.3f};
  bark.emission = {40, 0, 0.25f};
  bark.normal_scale = -2;
  bark.alpha_mode = AlphaMode::Mask;
  bark.alpha_cutoff = 0.75f;
  bark.base_color_map = {0, Wrap::Mirror, Wrap::Clamp};
  bark.mask_map = {1, Wrap::Repeat, Wrap::Mirror};
  manifest.materials.emplace_back().thin_transmission = 0.5f;
  return manifest;
}

TEST(Manifest, PlacesOfPartsComeBackAndMayBeAbsent) {
  Manifest manifest = sample_manifest();
  EXPECT_EQ(manifest_to_json(manifest).find("placements"), std::string::npos);
  manifest.levels[0].placements = 18150;
  EXPECT_EQ(manifest_from_json(manifest_to_json(manifest), "test")->levels[0].placements, 18150u);
}

TEST(Manifest, CostsOfRaysComeBackAndMayBeAbsent) {
  Manifest manifest = sample_manifest();
  EXPECT_EQ(manifest_from_json(manifest_to_json(manifest), "test")->levels[0].ray_cost, 0.0);
  manifest.levels[0].ray_cost = 310.5;
  EXPECT_EQ(manifest_from_json(manifest_to_json(manifest), "test")->levels[0].ray_cost, 310.5);
}

TEST(Manifest, MaterialsAndTexturesComeBack) {
  const Manifest manifest = textured_manifest();
  const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(manifest_to_json(*read), manifest_to_json(manifest));
  ASSERT_EQ(read->materials.size(), 2u);
  const AssetMaterial& bark = read->materials[0];
  EXPECT_EQ(bark.name, "bark \"old\"");
  EXPECT_EQ(bark.emission, vec3(40, 0, 0.25f));
  EXPECT_EQ(bark.alpha_mode, AlphaMode::Mask);
  EXPECT_EQ(bark.base_color_map.texture, 0u);
  EXPECT_EQ(bark.base_color_map.wrap_u, Wrap::Mirror);
  EXPECT_EQ(bark.mask_map.texture, 1u);
  EXPECT_FALSE(bark.normal_map);
  EXPECT_EQ(read->materials[1].thin_transmission, 0.5f);
  EXPECT_EQ(read->textures[0].height, 512u);
  EXPECT_EQ(read->textures[1].cache_bytes, 300u);
}

TEST(HostileManifest, MaterialsAndTexturesAreChecked) {
  const auto message = [](const std::function<void(Manifest&)>& spoil) {
    Manifest manifest = textured_manifest();
    spoil(manifest);
    const auto read = manifest_from_json(manifest_to_json(manifest), "test");
    return read ? std::string("accepted") : read.error().message;
  };
  EXPECT_EQ(message([](Manifest&) {}), "accepted");
  const auto expect = [&](const char* words, const std::function<void(Manifest&)>& spoil) {
    EXPECT_NE(message(spoil).find(words), std::string::npos) << message(spoil);
  };
  expect("texture 2, and there are 2", [](Manifest& m) { m.materials[0].normal_map.texture = 2; });
  expect("not a file name inside", [](Manifest& m) { m.textures[0].file = "../passwd"; });
  expect("serves two textures", [](Manifest& m) { m.textures[0].file = m.textures[1].file; });
  expect("out of range", [](Manifest& m) { m.textures[0].channels = 5; });
  expect("out of range", [](Manifest& m) { m.textures[0].width = 0; });
  expect("out of range", [](Manifest& m) { m.textures[1].cache_bytes = ~uint64_t{0}; });
}

TEST(Manifest, FieldsThatThisVersionDoesNotKnowAreIgnored) {
  Json json = Json::parse(manifest_to_json(sample_manifest()));
  json["note"] = {{"by", "someone"}};
  json["levels"][0]["note"] = 1;
  EXPECT_TRUE(manifest_from_json(json.dump(), "test"));
}

// ---- the checksum ----

TEST(Manifest, WhatIsWrittenHasAChecksumAndOlderTextsHaveNone) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_manifest(folder.path(), sample_manifest()));
  EXPECT_TRUE(read_manifest(folder.path())->has_checksum);
  EXPECT_FALSE(read_manifest(FARFIELD_TEST_DATA "/format_v1")->has_checksum);
  ASSERT_TRUE(write_manifest(folder.path(), *read_manifest(folder.path())));  // as `farfield evaluate` does
  EXPECT_TRUE(read_manifest(folder.path())->has_checksum);
}

TEST(HostileManifest, NoChangedByteOfAFileChangesWhatIsRead) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_manifest(folder.path(), sample_manifest()));
  const auto bytes = test::read_bytes(folder.path() / "manifest.json");
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string sound = manifest_to_json(*manifest_from_json(text, "test"));
  size_t refused = 0, tried = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    for (const char other : {'0', '7', ' ', static_cast<char>(text[i] ^ 1)}) {
      std::string changed = text;
      if (std::exchange(changed[i], other) == other) continue;
      ++tried;
      const Result<Manifest> read = manifest_from_json(changed, "test");
      refused += !read;
      if (read) {
        EXPECT_EQ(manifest_to_json(*read), sound) << i;
      }
    }
  }
  EXPECT_EQ(refused, tried - 4 * 8);  // all but those that make "checksum" another word
  std::string moved = text;
  moved.replace(moved.find("10000000.0"), 10, "10000001.0");
  EXPECT_NE(manifest_from_json(moved, "test").error().message.find("its checksum is wrong"), std::string::npos);
}

// ---- what is wrong with a manifest that is well-formed ----

struct ManifestCase {
  std::string words;
  std::function<void(Manifest&)> change;
};

TEST(HostileManifest, ValuesThatMakeNoSenseAreNeitherReadNorWritten) {
  const std::vector<ManifestCase> cases = {
      {"there are no levels", [](auto& m) { m.levels.clear(); }},
      {"levels[1]: level 0 follows level 0", [](auto& m) { m.levels[1].level = 0; }},
      {"levels[1]: level 1 follows level 3", [](auto& m) { std::swap(m.levels[0], m.levels[2]); }},
      {"levels[2]: its resolution is not coarser", [](auto& m) { m.levels[2].resolution = 0.25; }},
      {"levels[0]: its resolution is not positive", [](auto& m) { m.levels[0].resolution = 0; }},
      {"levels[0]: its resolution is not positive", [](auto& m) { m.levels[0].resolution = -1; }},
      {"levels[2]: level numbers end at 63", [](auto& m) { m.levels[2].level = 64; }},
      {"levels[2]: \"level_0.ffl\" serves two levels", [](auto& m) { m.levels[2].file = m.levels[0].file; }},
      {"bytes are more than any level has", [](auto& m) { m.levels[0].file_bytes = (uint64_t{1} << 50) + 1; }},
      {"bytes are more than any level has", [](auto& m) { m.levels[1].resident_bytes = ~uint64_t{0}; }},
      {"bytes are more than any level has", [](auto& m) { m.levels[1].build_peak_bytes = ~uint64_t{0}; }},
      {"elements are more than any level has", [](auto& m) { m.levels[1].triangles = ~uint64_t{0}; }},
      {"elements are more than any level has", [](auto& m) { m.levels[1].voxels = ~uint64_t{0}; }},
      {"elements are more than any level has", [](auto& m) { m.levels[1].bricks = ~uint64_t{0}; }},
      {"the bounds are empty", [](auto& m) { m.bounds.upper.y = -5.0f; }},
      {"base_resolution is not positive", [](auto& m) { m.base_resolution = 0; }},
      {"the hull has more than", [](auto& m) { m.hull.resize(10000); }},
  };
  const std::vector<ManifestCase> not_even_json = {
      {"the bounds are empty or not finite", [](auto& m) { m.bounds = Box3(); }},
      {"the origin is not finite", [=](auto& m) { m.origin.z = kNan; }},
      {"the rotation is none", [=](auto& m) { m.rotation[1].y = kNan; }},
      {"the rotation is none", [=](auto& m) { m.rotation *= 1.1; }},
      {"base_resolution is not positive", [=](auto& m) { m.base_resolution = kNan; }},
      {"a hull point is not finite", [=](auto& m) { m.hull[1].y = static_cast<float>(kNan); }},
      {"its ray_cost is negative", [](auto& m) { m.levels[1].ray_cost = -1; }},
      {"its ray_cost is negative or not finite", [=](auto& m) { m.levels[1].ray_cost = kNan; }},
      {"its errors are not finite", [=](auto& m) { m.levels[1].errors->color_error = kNan; }},
      {"its errors are not finite", [=](auto& m) { m.levels[1].errors->occlusion_rms = ErrorSize::unknown(0, kNan); }},
  };
  const TemporaryFolder folder;
  for (const auto* list : {&cases, &not_even_json}) {
    for (const auto& [words, change] : *list) {
      Manifest manifest = sample_manifest();
      change(manifest);
      const Result<void> written = write_manifest(folder.path(), manifest);
      ASSERT_FALSE(written) << words;
      EXPECT_EQ(written.error().code, ErrorCode::InvalidArgument);
      EXPECT_NE(written.error().message.find(words), std::string::npos) << written.error().message;
      const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
      ASSERT_FALSE(read) << words;
      EXPECT_EQ(read.error().code, ErrorCode::BadFile);
      if (list == &cases) {
        EXPECT_NE(read.error().message.find(words), std::string::npos) << read.error().message;
      }
    }
  }
  EXPECT_TRUE(folder.names().empty());
}

TEST(HostileManifest, FileNamesThatLeadOutOfTheFolderAreRefused) {
  const std::string names[] = {"",
                               "..",
                               ".",
                               "../level_0.ffl",
                               "/etc/passwd",
                               "a/b.ffl",
                               "a\\b.ffl",
                               ".hidden",
                               "manifest.json",
                               std::string("a\0b", 3),
                               "line\nbreak",
                               "level/../x",
                               std::string(300, 'x'),
                               "..\\x"};
  for (const std::string& name : names) {
    Manifest manifest = sample_manifest();
    manifest.levels[1].file = name;
    const Result<Manifest> read = manifest_from_json(manifest_to_json(manifest), "test");
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().message.find("is not a file name inside the folder"), std::string::npos)
        << read.error().message;
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos) << "one line, whatever the name";
  }
}

// ---- text ----

std::string message_of(std::string_view text, ErrorCode code = ErrorCode::BadFile) {
  const Result<Manifest> read = manifest_from_json(text, "oak/manifest.json");
  EXPECT_FALSE(read) << text.substr(0, 200);
  if (read) return "";
  EXPECT_EQ(read.error().code, code);
  EXPECT_NE(read.error().message.find("oak/manifest.json"), std::string::npos) << read.error().message;
  EXPECT_LT(read.error().message.size(), 1000u) << "the message repeats the file";
  return read.error().message;
}

void expect_message(std::string_view text, const std::string& words, ErrorCode code = ErrorCode::BadFile) {
  const std::string message = message_of(text, code);
  EXPECT_NE(message.find(words), std::string::npos) << message << "\nexpected: " << words;
}

/// The sample's text with one value replaced.
std::string with(const std::string& pointer, const std::string& value) {
  Json json = Json::parse(manifest_to_json(sample_manifest()));
  json[Json::json_pointer(pointer)] = "@";
  std::string text = json.dump();
  return text.replace(text.find("\"@\""), 3, value);
}

TEST(HostileManifest, VersionsAreCheckedFirst) {
  expect_message(with("/version", "3"), "format version 3, and this Farfield reads up to 2", ErrorCode::Unsupported);
  expect_message(R"({"version": 18446744073709551615})", "use a newer Farfield", ErrorCode::Unsupported);
  expect_message(with("/version", "0"), "the format version is 0");
  for (const char* value : {"-1", "1.0", "\"1\"", "null", "[]", "1e3"}) {
    expect_message(with("/version", value), "version must be an integer");
  }
}

TEST(HostileManifest, NumbersThatDoNotFitAreRefused) {
  expect_message(with("/base_resolution", "1e999"), "number overflow");
  expect_message(with("/base_resolution", "NaN"), "its JSON is wrong");
  expect_message(with("/base_resolution", "-Infinity"), "its JSON is wrong");
  expect_message(with("/origin", "[1, 2, 1e400]"), "number overflow");
  expect_message(with("/bounds_upper", "[1, 2, 1e39]"), "not finite");  // fits a double, not a float
  expect_message(with("/hull/0", "[0, 0, -1e300]"), "not finite");
  expect_message(with("/levels/0/triangles", "18446744073709551616"), "levels[0].triangles must be an integer");
  expect_message(with("/levels/0/triangles", "99999999999999999999999999999999999"), "must be an integer");
  expect_message(with("/levels/0/triangles", "-1"), "must be an integer");
  expect_message(with("/levels/0/triangles", "1.5"), "must be an integer");
  expect_message(with("/levels/0/level", "4294967296"), "levels[0].level must be an integer below 2^32");
  expect_message(with("/levels/0/grid", "4294967296"), "below 2^32");
  expect_message(with("/source_hash", "\"123\""), "source_hash must be a hash of 16");
  expect_message(with("/source_hash", "\"0x23456789abcdef\""), "source_hash must be a hash of 16");
  expect_message(with("/source_hash", "\"-123456789abcdef\""), "source_hash must be a hash of 16");
  expect_message(with("/source_hash", "81985529216486895"), "source_hash must be a text");
  expect_message(with("/levels/1/errors/color_error", "\"x\""), "levels[1].errors.color_error must be a number");
  expect_message(with("/levels/1/errors", "[]"), "levels[1].errors must be an object");
  expect_message(with("/source_files", "3"), "source_files must be a list");
  expect_message(with("/source_files", "[{\"file\": 1}]"), "source_files[0].file must be a text");
  expect_message(with("/source_files", "[{\"file\": \"a\", \"hash\": \"1\"}]"), "source_files[0].hash must be a hash");
  expect_message(with("/warnings", "[1]"), "warnings[0] must be a text");
  expect_message(with("/levels/1", "7"), "levels[1] must be an object");
  expect_message(with("/origin", "[1, 2]"), "origin must be three numbers");
  expect_message(with("/hull", "{}"), "hull must be a list");
  expect_message(with("/hull/1", "[1, 2, \"3\"]"), "hull[1] must be a number");
}

TEST(HostileManifest, EachFieldIsRequiredAndTyped) {
  const Json whole = Json::parse(manifest_to_json(sample_manifest()));
  const auto check = [&](const Json::json_pointer& parent, const std::string& key) {
    Json without = whole;
    without[parent].erase(key);
    expect_message(without.dump(), "\"" + key + "\" is missing");
    for (const char* value : {"null", "true", "{}", "[[[]]]", "\"\"", "-1e300"}) {
      Json changed = whole;
      changed[parent][key] = Json::parse(value);
      if (const Result<Manifest> read = manifest_from_json(changed.dump(), "test")) {
        EXPECT_TRUE(manifest_from_json(manifest_to_json(*read), "test")) << key << " " << value;
      }
    }
  };
  for (const auto& [key, value] : whole.items()) check(Json::json_pointer(), key);
  for (const auto& [key, value] : whole["levels"][0].items()) check(Json::json_pointer("/levels/0"), key);
  for (const auto& [key, value] : whole["levels"][1]["errors"].items()) {
    check(Json::json_pointer("/levels/1/errors"), key);
  }
}

TEST(HostileManifest, DeepNestingIsRefusedWithoutRecursion) {
  for (const size_t depth : {size_t{20}, size_t{100000}, size_t{2000000}}) {
    const std::string open(depth, '['), close(depth, ']');
    expect_message(with("/options", open + close), "nested deeper");
    message_of(open);
    std::string objects;
    for (size_t i = 0; i < std::min<size_t>(depth, 100000); ++i) objects += "{\"a\":";
    message_of(objects);
  }
}

TEST(HostileManifest, AMillionLevelsAreRefused) {
  Json level = Json::parse(manifest_to_json(sample_manifest()))["levels"][0];
  std::string levels = "[";
  for (int i = 0; i < 1000000; ++i) levels += "{},";
  expect_message(with("/levels", levels + level.dump() + "]"), "there are 1000001 levels, and at most 64");
  std::string points = "[";
  for (int i = 0; i < 1000000; ++i) points += "[0,0,0],";
  expect_message(with("/hull", points + "[0,0,0]]"), "the hull has more than 8192 points");
}

// Twice the bytes that read_manifest() takes. Past the time limit of a test if looking for a key took time in
// proportion to their number.
TEST(HostileManifest, AMillionKeysAreIgnored) {
  std::string text = manifest_to_json(sample_manifest());
  text.resize(text.rfind('}'));
  for (int i = 0; text.size() < 8000000; ++i) text += ",\"" + std::to_string(i) + "\":0";
  const Result<Manifest> read = manifest_from_json(text + "}", "test");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(manifest_to_json(*read), manifest_to_json(sample_manifest()));
}

TEST(HostileManifest, TextThatIsNoJsonIsRefused) {
  message_of("");
  message_of(" ");
  message_of("null");
  message_of("[]");
  message_of("\"text\"");
  message_of("{");
  message_of(std::string("\0\0\0", 3));
  message_of("{\"version\": 1, \"generator\": \"\xff\xfe\"}");
  message_of(std::string(1 << 20, 'x'));
  message_of("{\"" + std::string(1 << 20, 'k') + "\": 1");
  message_of("{\"" + std::string(1 << 20, 'k'));
}

TEST(HostileManifest, EveryTruncationIsRefused) {
  const std::string text = manifest_to_json(sample_manifest());
  for (size_t size = 0; size + 2 < text.size(); ++size) {
    ASSERT_FALSE(manifest_from_json(text.substr(0, size), "test")) << size;
  }
}

TEST(HostileManifest, DamagedTextIsRefusedOrStillSound) {
  const std::string text = manifest_to_json(sample_manifest());
  Rng rng(12);
  for (int trial = 0; trial < 5000; ++trial) {
    std::string damaged = text;
    for (uint32_t change = 0; change <= rng.next_uint() % 3; ++change) {
      damaged[rng.next_uint() % damaged.size()] = "0129-.e\"[]{},\\\n\xff x"[rng.next_uint() % 19];
    }
    if (const Result<Manifest> read = manifest_from_json(damaged, "test")) {
      EXPECT_TRUE(manifest_from_json(manifest_to_json(*read), "test"));
    }
  }
}

TEST(ReadManifest, TellsAFolderThatIsNoAssetFromABrokenOne) {
  const TemporaryFolder folder;
  const Result<Manifest> missing = read_manifest(folder.path());
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_NE(missing.error().message.find("farfield bake"), std::string::npos);

  test::write_text(folder.path() / kManifestName, "{}");
  EXPECT_EQ(read_manifest(folder.path()).error().code, ErrorCode::BadFile);
  std::filesystem::resize_file(folder.path() / kManifestName, uint64_t{1} << 40);
  EXPECT_EQ(read_manifest(folder.path()).error().code, ErrorCode::BadFile);

  const TemporaryFolder linked;
  ASSERT_TRUE(write_manifest(folder.path(), sample_manifest()));
  std::filesystem::create_symlink(folder.path() / kManifestName, linked.path() / kManifestName);
  EXPECT_EQ(read_manifest(linked.path()).error().code, ErrorCode::BadFile);
}

}  // namespace
}  // namespace farfield
