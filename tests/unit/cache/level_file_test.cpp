// SPDX-License-Identifier: Apache-2.0
#include "cache/level_file.h"
#include "cache/level_check.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/random.h"
#include "cache/level_format.h"
#include "tests/support/files.h"
#include "tests/support/level_builder.h"
#include "tests/support/level_image.h"

namespace farfield {
namespace {

using test::FileImage;
using test::full_level;
using test::TemporaryFolder;

void expect_same(const LevelView& a, const LevelView& b) {
  EXPECT_EQ(a.header.level, b.header.level);
  EXPECT_EQ(a.header.resolution, b.header.resolution);
  EXPECT_EQ(a.header.bounds.lower, b.header.bounds.lower);
  EXPECT_EQ(a.header.bounds.upper, b.header.bounds.upper);
  EXPECT_EQ(a.header.brick_dims, b.header.brick_dims);
  EXPECT_EQ(a.header.volume_origin, b.header.volume_origin);
  EXPECT_EQ(a.header.hot_spot, b.header.hot_spot);
  EXPECT_EQ(a.header.open_side, b.header.open_side);
  EXPECT_EQ(a.header.medium, b.header.medium);
  EXPECT_EQ(a.header.fog_albedo, b.header.fog_albedo);
  EXPECT_EQ(a.header.fog_anisotropy, b.header.fog_anisotropy);
  EXPECT_EQ(a.header.highlight_lean, b.header.highlight_lean);
  std::vector<std::span<const std::byte>> sections;
  for_each_section(a, [&](SectionId, const auto& array) { sections.push_back(std::as_bytes(array)); });
  size_t i = 0;
  for_each_section(b, [&](SectionId id, const auto& array) {
    const auto bytes = std::as_bytes(array);
    EXPECT_EQ(sections[i].size(), bytes.size()) << section_name(id);
    EXPECT_TRUE(std::ranges::equal(sections[i], bytes)) << section_name(id);
    ++i;
  });
}

TEST(LevelFile, GivesBackWhatWasWritten) {
  const TemporaryFolder folder;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    const LevelData level = seed == 0
                                ? full_level()
                                : test::random_level(seed, static_cast<uint32_t>(seed % 7 * seed + (seed % 3 == 0)),
                                                     static_cast<uint32_t>(seed % 4 * seed / 3 + (seed % 3 == 0)));
    if (!level.has_surface() && !level.has_volume()) continue;
    const auto path = folder.path() / fmt::format("{}.ffl", seed);
    const Result<uint64_t> written = write_level(path, level);
    ASSERT_TRUE(written) << written.error().message;
    for (const LevelCheck check : {LevelCheck::Structure, LevelCheck::Full}) {
      const auto file = LevelFile::open(path, check);
      ASSERT_TRUE(file) << file.error().message;
      expect_same((*file)->view(), view_of(level));
      EXPECT_EQ((*file)->file_bytes(), *written);
      EXPECT_EQ(std::filesystem::file_size(path), *written);
      for_each_section((*file)->view(), [](SectionId id, const auto& array) {
        EXPECT_EQ(reinterpret_cast<uintptr_t>(array.data()) % 64, 0u) << section_name(id);
      });
    }
  }
}

TEST(LevelFile, BytesDependOnlyOnTheLevel) {
  const TemporaryFolder folder;
  for (uint64_t seed = 1; seed < 10; ++seed) {
    const LevelData level = test::random_level(seed, 100, 10);
    ASSERT_TRUE(write_level(folder.path() / "a", level));
    FileImage image(view_of(level));
    EXPECT_TRUE(std::ranges::equal(test::read_bytes(folder.path() / "a"), image.bytes()));
  }
}

TEST(LevelFile, SizesAreKnownBeforeWriting) {
  const TemporaryFolder folder;
  const LevelData level = test::random_level(6, 5000, 10);
  const auto path = folder.path() / "a.ffl";
  const LevelFileSizes sizes = level_file_sizes(view_of(level));
  EXPECT_EQ(*write_level(path, level), sizes.file_bytes);
  EXPECT_EQ(sizes.memory_bytes, (sizes.file_bytes + 4095) / 4096 * 4096);
  const auto file = LevelFile::open(path, LevelCheck::Full);
  ASSERT_TRUE(file);
  EXPECT_EQ((*file)->build_only_bytes(), sizes.build_only_bytes);
  // 5003 positions and 5000 quads: at most the first and the last page are shared with other sections.
  EXPECT_EQ(sizes.build_only_bytes % 4096, 0u);
  EXPECT_GE(sizes.build_only_bytes, 5003u * 12 + 5000 * 16 - 2 * 4096);
  EXPECT_EQ(level_file_sizes(view_of(full_level())).build_only_bytes, 0u);
}

TEST(LevelFile, MorphMapsAreGivenBackToo) {
  LevelData level = test::random_level(6, 5000, 10);
  level.morph_vertex.clear();
  level.morph_face.clear();
  const LevelFileSizes without = level_file_sizes(view_of(level));
  level.morph_vertex.assign(10000, 0);
  level.morph_face.assign(10000, 0);
  const LevelFileSizes with = level_file_sizes(view_of(level));
  EXPECT_GE(with.build_only_bytes, without.build_only_bytes + 80000 - 2 * 4096);
  EXPECT_LE(with.build_only_bytes, with.memory_bytes);
}

TEST(LevelFile, OnlyBuildPagesAreGivenBack) {
  const TemporaryFolder folder;
  const LevelData level = test::random_level(6, 5000, 10);
  const auto path = folder.path() / "a.ffl";
  ASSERT_TRUE(write_level(path, level));
  const auto file = LevelFile::open(path, LevelCheck::Full);
  ASSERT_TRUE(file);
  (*file)->release_build_pages();
  const LevelView& view = (*file)->view();
  size_t kept = 0;
  for_each_section(view, [&](SectionId id, const auto& array) {
    const std::span<const std::byte> now = std::as_bytes(array);
    std::span<const std::byte> before;
    for_each_section(level, [&](SectionId other, const auto& original) {
      if (other == id) before = std::as_bytes(std::span(original));
    });
    if (id == SectionId::Positions || id == SectionId::Quads) {
      EXPECT_TRUE(std::ranges::all_of(now.subspan(8192, 4096), [](std::byte b) { return b == std::byte{0}; }));
    } else if (id != SectionId::MorphVertex && id != SectionId::MorphFace) {
      EXPECT_TRUE(std::ranges::equal(now, before)) << section_name(id);
      kept += now.size();
    }
  });
  EXPECT_GT(kept, 0u);
}

// ---- what happens to a file after it was opened ----

TEST(LevelFile, WhatIsOpenDoesNotChangeWithItsFile) {
  const TemporaryFolder folder;
  const LevelData level = test::random_level(6, 5000, 10);
  const auto path = folder.path() / "a.ffl";
  const auto open_again = [&] {
    EXPECT_TRUE(write_level(path, level));
    return LevelFile::open(path, LevelCheck::Structure);
  };
  const auto truncated = open_again();
  ASSERT_TRUE(truncated);
  const uint64_t before = test::walk((*truncated)->view());
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ(test::walk((*truncated)->view()), before);  // was a SIGBUS while files were mapped

  const auto overwritten = open_again();
  ASSERT_TRUE(overwritten);
  std::vector<std::byte> garbage(std::filesystem::file_size(path), std::byte{0xff});
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary)
      .write(reinterpret_cast<const char*>(garbage.data()), static_cast<std::streamsize>(garbage.size()));
  EXPECT_EQ(test::walk((*overwritten)->view()), before);

  const auto removed = open_again();
  ASSERT_TRUE(removed);
  std::filesystem::remove(path);
  EXPECT_EQ(test::walk((*removed)->view()), before);
}

TEST(LevelFile, AFileOfAnotherSizeOrContentIsNotTheKnownOne) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "a.ffl";
  const Result<uint64_t> bytes = write_level(path, test::random_level(6, 50, 10));
  ASSERT_TRUE(bytes);
  const uint64_t hash = *hash_file(path);
  EXPECT_TRUE(LevelFile::open_known(path, *bytes, hash));
  const auto refusal = [&](uint64_t file_bytes, uint64_t file_hash) {
    const auto file = LevelFile::open_known(path, file_bytes, file_hash);
    return file ? Error{ErrorCode::Io, "none"} : file.error();
  };
  EXPECT_EQ(refusal(*bytes, hash + 1).code, ErrorCode::BadFile);
  EXPECT_NE(refusal(*bytes + 1, hash).message.find("where its manifest says"), std::string::npos);
  std::filesystem::resize_file(path, uint64_t{1} << 36);  // sparse: reading it would fill the memory
  EXPECT_EQ(refusal(*bytes, hash).code, ErrorCode::BadFile);
}

// ---- the format ----

/// Made by this test's first version. If it fails, the format has changed: give it a new version, keep reading this
/// one.
void expect_frozen(const char* file, size_t bytes, const LevelData& level) {
  const std::vector<std::byte> golden = test::read_bytes(std::string(FARFIELD_TEST_DATA) + file);
  ASSERT_EQ(golden.size(), bytes);
  FileImage written(view_of(level));
  EXPECT_TRUE(std::ranges::equal(golden, written.bytes()));

  FileImage image(golden);
  const Result<LevelView> view = parse_level(image.bytes(), LevelCheck::Full, "golden");
  ASSERT_TRUE(view) << view.error().message;
  expect_same(*view, view_of(level));
}

TEST(LevelFormat, GoldenBytesOfVersion1AreFrozen) { expect_frozen("/format_v1/level_3.ffl", 3264u, full_level()); }

TEST(LevelFormat, GoldenBytesOfVersion2AreFrozen) {
  expect_frozen("/format_v2/level_3.ffl", 4160u, test::full_level_of_version_2());
}

TEST(LevelFormat, GoldenBytesOfVersion3AreFrozen) {
  expect_frozen("/format_v3/level_3.ffl", 4288u, test::full_level_of_version_3());
}

TEST(LevelFormat, GoldenBytesOfVersion4AreFrozen) {
  expect_frozen("/format_v4/level_3.ffl", 4416u, test::full_level_of_version_4());
}

TEST(LevelFormat, GoldenBytesOfVersion5AreFrozen) {
  expect_frozen("/format_v5/level_3.ffl", 4416u, test::full_level_of_version_5());
}

TEST(LevelFormat, GoldenBytesOfVersion6AreFrozen) {
  expect_frozen("/format_v6/level_3.ffl", 3840u, test::full_level_of_version_6());
}

TEST(LevelFormat, GoldenBytesOfVersion7AreFrozen) {
  expect_frozen("/format_v7/level_3.ffl", 4480u, test::full_level_of_version_7());
}

TEST(LevelFormat, GoldenBytesOfVersion8AreFrozen) {
  expect_frozen("/format_v8/level_3.ffl", 4352u, test::full_level_of_version_8());
}

/// What is wrong with a spoilt level, in structure or values; empty: nothing.
std::string problem_of(LevelData level, const std::function<void(LevelData&)>& spoil) {
  spoil(level);
  const auto in_structure = find_structure_problem(view_of(level));
  return in_structure ? *in_structure : find_value_problem(view_of(level)).value_or("");
}

TEST(LevelFormat, PlacesOfPartsAreChecked) {
  const auto problem = [](const std::function<void(LevelData&)>& spoil) {
    return problem_of(test::full_level_of_version_8(), spoil);
  };
  EXPECT_EQ(problem([](LevelData&) {}), "");
  EXPECT_EQ(problem([](LevelData& l) { l.placements.clear(); }), "part_first_quad and placements do not go together");
  EXPECT_EQ(problem([](LevelData& l) { l.part_first_quad.clear(); }),
            "part_first_quad and placements do not go together");
  EXPECT_EQ(problem([](LevelData& l) { l.part_first_quad = {2}; }),
            "part_first_quad[0] is 2 of 2 quads, and parts are not empty");
  EXPECT_EQ(problem([](LevelData& l) {
              l.part_first_quad = {1, 1};
            }),
            "part_first_quad[1] is 1 of 2 quads, and parts are not empty");
  EXPECT_EQ(problem([](LevelData& l) { l.placements[1].part = 1; }), "placements[1] is of part 1, and there are 1");
  EXPECT_EQ(problem([](LevelData& l) { l.placements[0].level_to_part[2] = vec3(0); }), "placements[0] has no inverse");
  EXPECT_EQ(problem([](LevelData& l) { l.placements[0].level_to_part[3].x = NAN; }), "placements[0] has no inverse");
  EXPECT_EQ(problem([](LevelData& l) { l.placements[0].level_to_part[3].x = 1e19f; }), "placements[0] has no inverse");
  EXPECT_EQ(problem([](LevelData& l) { l.placements[0].level_to_part = mat4x3(1e-30f); }),
            "placements[0] has no inverse");
  EXPECT_EQ(problem([](LevelData& l) { l.face_gap.resize(3); }),
            "it has parts, and faces that are not those of a source");
  // A part's own space is not the level's.
  EXPECT_EQ(problem([](LevelData& l) {
              l.positions[3] = vec3(-1e9f);
              l.quads = {{0, 1, 0, 2}, {3, 3, 3, 3}};
            }),
            "");
  EXPECT_EQ(problem([](LevelData& l) { l.positions[1] = vec3(1e9f); }),
            "positions[1] = (1000000000, 1000000000, 1000000000) is not inside the bounds");
  EXPECT_EQ(problem([](LevelData& l) {
              l.positions[3] = vec3(NAN);
              l.quads = {{0, 1, 0, 2}, {3, 3, 3, 3}};
            }),
            "positions[3] = (nan, nan, nan) is not inside the bounds");
}

TEST(LevelFormat, PartsInTooManyPlacesAreRefused) {
  LevelData level = test::empty_level(0, 1);
  std::vector<Quad> quads(1 << 15, Quad{0, 1, 2, 2});
  test::set_quads(level, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, quads);
  level.part_first_quad = {0};
  level.placements.resize(1 << 13);
  EXPECT_EQ(find_structure_problem(view_of(level)).value_or(""), "");
  level.placements.resize((1 << 13) + 1);
  EXPECT_EQ(find_structure_problem(view_of(level)).value_or(""), "its parts have too many quads in all places");
}

TEST(LevelFormat, ShapesOfSheetsNeedGaps) {
  LevelData level = test::full_level_of_version_7();
  level.face_gap.clear();
  EXPECT_EQ(find_structure_problem(view_of(level)).value_or(""), "face_sheet_shape needs face_gap");
}

TEST(LevelFormat, FogHasNothingOfFlakesAndFlakesNothingOfFog) {
  const auto problem = [](const std::function<void(LevelData&)>& spoil) {
    return problem_of(test::full_level_of_version_6(), spoil);
  };
  EXPECT_EQ(problem([](LevelData&) {}), "");
  EXPECT_EQ(problem([](LevelData& l) { l.voxel_diffuse.resize(5); }), "its fog has properties of flakes");
  EXPECT_EQ(problem([](LevelData& l) { l.header.medium = Medium::Flakes; }), "it has properties of fog, and no fog");
  EXPECT_EQ(problem([](LevelData& l) { l.header.fog_albedo.y = 1.5f; }), "the fog's albedo is (0.25, 1.5, 1)");
  EXPECT_EQ(problem([](LevelData& l) { l.header.fog_albedo.y = NAN; }), "the fog's albedo is (0.25, nan, 1)");
  EXPECT_EQ(problem([](LevelData& l) { l.header.fog_anisotropy = 1; }), "the fog's anisotropy is 1");
  EXPECT_EQ(problem([](LevelData& l) { l.voxel_anisotropy[2] = -128; }), "voxel_anisotropy[2] is -128");
  EXPECT_EQ(problem([](LevelData& l) { l.voxel_albedo.pop_back(); }), "voxel_albedo has 4 elements for 5 voxels");
}

TEST(LevelFormat, OctantsMustBelongToVoxels) {
  LevelData level = test::full_level_of_version_4();
  level.voxel_octants.pop_back();
  EXPECT_EQ(find_structure_problem(view_of(level)).value_or(""), "voxel_octants has 4 elements for 5 voxels");
}

TEST(LevelFormat, GapsMustBelongToFaces) {
  LevelData level = test::full_level_of_version_3();
  level.face_gap.pop_back();
  EXPECT_EQ(find_structure_problem(view_of(level)).value_or(""), "face_gap has 2 elements for 3 faces");
}

TEST(LevelFile, CornersMustReferToShadingVertices) {
  const auto problem = [](const std::function<void(LevelData&)>& spoil) {
    LevelData level = test::full_level_of_version_2();
    spoil(level);
    return find_structure_problem(view_of(level)).value_or("");
  };
  EXPECT_EQ(problem([](LevelData&) {}), "");
  EXPECT_EQ(problem([](LevelData& l) { l.corner_vertex[1].z = 3; }),
            "corner_vertex[1] = (2, 1, 3), and there are 3 shading vertices");
  EXPECT_EQ(problem([](LevelData& l) { l.corner_vertex.clear(); }),
            "corner_vertex and shading vertices do not go together");
  EXPECT_EQ(problem([](LevelData& l) { l.shading_uv.pop_back(); }), "shading_uv has 2 elements for 3 shading vertices");
  EXPECT_EQ(problem([](LevelData& l) { l.face_opacity.pop_back(); }), "face_opacity has 2 elements for 3 faces");
  EXPECT_EQ(problem([](LevelData& l) { l.voxel_emission.pop_back(); }), "voxel_emission has 4 elements for 5 voxels");
}

TEST(LevelFormat, EverySectionStartsAtTheNextCacheLine) {
  for (uint64_t seed = 0; seed < 50; ++seed) {
    const LevelData level = seed == 0 ? full_level() : test::random_level(seed, 20, 3);
    const LevelLayout layout = layout_of(view_of(level));
    uint64_t end = 128 + 40 * layout.sections.size();
    for (const SectionEntry& section : layout.sections) {
      EXPECT_EQ(section.offset % 64, 0u);
      EXPECT_GE(section.offset, end);
      EXPECT_LT(section.offset, end + 64);
      end = section.offset + section.bytes;
      if (section.id == static_cast<uint32_t>(SectionId::Positions)) end += 16;
    }
    EXPECT_EQ(layout.file_bytes, (end + 63) / 64 * 64);
  }
}

// ---- hostile bytes ----

constexpr LevelCheck kBothChecks[] = {LevelCheck::Structure, LevelCheck::Full};

Result<LevelView> parse(FileImage& image, LevelCheck check = LevelCheck::Structure) {
  return parse_level(image.bytes(), check, "test.ffl");
}

void expect_refused(FileImage& image, ErrorCode code, const std::string& words, LevelCheck check) {
  const Result<LevelView> view = parse(image, check);
  ASSERT_FALSE(view) << "expected: " << words;
  EXPECT_EQ(view.error().code, code) << view.error().message;
  EXPECT_NE(view.error().message.find(words), std::string::npos) << view.error().message << "\nexpected: " << words;
  EXPECT_NE(view.error().message.find("test.ffl"), std::string::npos);
  EXPECT_EQ(view.error().message.find('\n'), std::string::npos);
}

TEST(HostileLevelFile, EveryTruncationIsRefused) {
  FileImage whole(view_of(full_level()));
  for (size_t size = 0; size < whole.bytes().size(); ++size) {
    FileImage part(whole.bytes().first(size));
    for (const LevelCheck check : kBothChecks) {
      const Result<LevelView> view = parse(part, check);
      ASSERT_FALSE(view) << size;
      ASSERT_EQ(view.error().code, ErrorCode::BadFile);
    }
  }
}

TEST(HostileLevelFile, EveryTruncationIsRefusedEvenIfTheHeaderAgrees) {
  FileImage whole(view_of(full_level()));
  for (size_t size = 0; size < whole.bytes().size(); ++size) {
    FileImage part(whole.bytes().first(size));
    if (size >= sizeof(FileHeader)) {
      const uint64_t file_bytes = size;
      std::memcpy(part.bytes().data() + offsetof(FileHeader, file_bytes), &file_bytes, sizeof file_bytes);
      seal_head(part.bytes());
    }
    ASSERT_FALSE(parse(part)) << size;
  }
}

TEST(HostileLevelFile, TrailingBytesAreRefused) {
  FileImage whole(view_of(full_level()));
  std::vector<std::byte> longer(whole.bytes().begin(), whole.bytes().end());
  longer.resize(longer.size() + 64);
  FileImage image(longer);
  expect_refused(image, ErrorCode::BadFile, "the header says 3264 bytes, and the file has 3328", LevelCheck::Structure);
}

TEST(HostileLevelFile, FullCheckFindsEveryFlippedBit) {
  FileImage image(view_of(full_level()));
  for (size_t i = 0; i < image.bytes().size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      image.bytes()[i] ^= std::byte{1} << bit;
      ASSERT_FALSE(parse(image, LevelCheck::Full)) << "byte " << i << " bit " << bit;
      image.bytes()[i] ^= std::byte{1} << bit;
    }
  }
  EXPECT_TRUE(parse(image, LevelCheck::Full));
}

TEST(HostileLevelFile, WhatTheStructureCheckAcceptsNeverLeavesTheFile) {
  // Damage of one to four bytes, the head's checksum made to agree. What still parses is read in full (run under ASan).
  Rng rng(11);
  int accepted = 0;
  for (int trial = 0; trial < 60000; ++trial) {
    static const LevelData levels[] = {full_level(), test::random_level(3, 12, 0), test::random_level(4, 0, 2),
                                       test::random_level(5, 7, 1)};
    static std::array<FileImage, 4> images = {FileImage(view_of(levels[0])), FileImage(view_of(levels[1])),
                                              FileImage(view_of(levels[2])), FileImage(view_of(levels[3]))};
    FileImage image = images[rng.next_uint() % 4];
    const bool in_head = rng.next_uint() % 2 == 0;
    const size_t range = in_head ? std::min<size_t>(128 + 40 * 18, image.bytes().size()) : image.bytes().size();
    for (uint32_t change = 0; change <= rng.next_uint() % 4; ++change) {
      const std::byte values[] = {std::byte{0}, std::byte{1}, std::byte{0xff}, static_cast<std::byte>(rng.next_uint())};
      image.bytes()[rng.next_uint() % range] = values[rng.next_uint() % 4];
    }
    seal_head(image.bytes());
    if (const Result<LevelView> view = parse(image)) {
      ++accepted;
      test::walk(*view);
    }
  }
  EXPECT_GT(accepted, 1000);  // damage of payloads is not the structure's business
}

TEST(HostileLevelFile, HeaderAndTableFieldsAreChecked) {
  struct Case {
    std::string words;
    std::function<void(FileHeader&, SectionEntry*)> change;
    ErrorCode code = ErrorCode::BadFile;
  };
  constexpr uint64_t kHuge = ~uint64_t{0};
  const std::vector<Case> cases = {
      {"does not start as a level file", [](auto& h, auto*) { h.magic[1] = 'X'; }},
      {"the format version is 0", [](auto& h, auto*) { h.version = 0; }},
      {"level format 9, and this Farfield reads up to 8", [](auto& h, auto*) { h.version = 9; },
       ErrorCode::Unsupported},
      {"the header says", [](auto& h, auto*) { h.file_bytes = kHuge; }},
      {"sections leaves the file", [](auto& h, auto*) { h.section_count = 0xffffffffu; }},
      {"the medium is number 2", [](auto& h, auto*) { h.medium = 2; }},
      {"it has properties of fog, and no fog", [](auto& h, auto*) { h.fog_anisotropy = 0.5f; }},
      {"the hot spot's strength is -0.1", [](auto& h, auto*) { h.hot_spot = -0.1f; }},
      {"the hot spot's strength is 0.71", [](auto& h, auto*) { h.hot_spot = 0.71f; }},
      {"the open side is (0, 0.6, 0)",
       [](auto& h, auto*) {
         h.open_side = {0, 0.6f, 0};
       }},
      {"the open side is (nan, 0, 0)",
       [](auto& h, auto*) {
         h.open_side = {NAN, 0, 0};
       }},
      {"the highlight leans by -0.71", [](auto& h, auto*) { h.highlight_lean = -0.71f; }},
      {"the highlight leans by nan", [](auto& h, auto*) { h.highlight_lean = NAN; }},
      {"the hot spot's strength is nan", [](auto& h, auto*) { h.hot_spot = NAN; }},
      {"the resolution is 0", [](auto& h, auto*) { h.resolution = 0; }},
      {"the resolution is nan", [](auto& h, auto*) { h.resolution = NAN; }},
      {"the resolution is inf", [](auto& h, auto*) { h.resolution = INFINITY; }},
      {"bounds are empty", [](auto& h, auto*) { h.bounds_lower[1] = 1e9f; }},
      {"bounds are empty or not finite", [](auto& h, auto*) { h.bounds_upper[2] = NAN; }},
      {"origin is not finite", [](auto& h, auto*) { h.volume_origin[0] = -INFINITY; }},
      {"brick_dims are -2 x 1 x 1", [](auto& h, auto*) { h.brick_dims[0] = -2; }},
      {"brick_dims are 2147483647 x", [](auto& h, auto*) { h.brick_dims[0] = 0x7fffffff; }},
      {"brick_dims are 2 x 0 x 1", [](auto& h, auto*) { h.brick_dims[1] = 0; }},
      {"brick_table has 2 elements for 2 x 1 x 2", [](auto& h, auto*) { h.brick_dims[2] = 2; }},
      {"section id 99 is unknown", [](auto&, auto* t) { t[3].id = 99; }},
      {"section id 1 is unknown, repeated or out of order", [](auto&, auto* t) { t[1].id = 1; }},
      {"section id 4 is unknown, repeated or out of order", [](auto&, auto* t) { t[2].id = 18; }},
      {"section quads has elements of 12 bytes, expected 16", [](auto&, auto* t) { t[1].element_bytes = 12; }},
      {"section positions has 0 elements", [](auto&, auto* t) { t[0].count = 0; }},
      {"section positions has 18446744073709551615 elements", [](auto&, auto* t) { t[0].count = kHuge; }},
      // 4 + 2^62 elements of 12 bytes are 48 bytes modulo 2^64
      {"elements in a file of", [](auto&, auto* t) { t[0].count = 4 + (uint64_t{1} << 62); }},
      {"section positions has 49 bytes, expected 48", [](auto&, auto* t) { t[0].bytes = 49; }},
      {"section quads lies at byte 1, expected 960", [](auto&, auto* t) { t[1].offset = 1; }},
      {"section quads lies at byte 18446744073709551552", [](auto&, auto* t) { t[1].offset = kHuge - 63; }},
      {"leaves the file",
       [](auto&, auto* t) {
         t[17].count = 100;
         t[17].bytes = 400;
       }},
  };
  for (const Case& test_case : cases) {
    FileImage image(view_of(full_level()));
    auto* header = reinterpret_cast<FileHeader*>(image.bytes().data());
    auto* table = reinterpret_cast<SectionEntry*>(image.bytes().data() + sizeof(FileHeader));
    test_case.change(*header, table);
    seal_head(image.bytes());
    expect_refused(image, test_case.code, test_case.words, LevelCheck::Structure);
  }
}

TEST(HostileLevelFile, BytesThatNoSectionClaimsAreRefused) {
  LevelData level = full_level();
  level.morph_face.assign(40, 0);
  FileImage image(view_of(level));
  auto* table = reinterpret_cast<SectionEntry*>(image.bytes().data() + sizeof(FileHeader));
  table[17].count = 1;
  table[17].bytes = 4;
  seal_head(image.bytes());
  expect_refused(image, ErrorCode::BadFile, "its sections end at byte", LevelCheck::Structure);
}

struct LevelCase {
  std::string words;
  std::function<void(LevelData&)> change;
};

TEST(HostileLevelFile, StructureCheckFindsEveryIndexThatLeavesItsArray) {
  const std::vector<LevelCase> cases = {
      {"quads[1] = (0, 4, 3, 3), and there are 4 vertices", [](auto& l) { l.quads[1].v1 = 4; }},
      {"quads[0] =", [](auto& l) { l.quads[0].v0 = 0xffffffffu; }},
      {"quads[0] =", [](auto& l) { l.positions.clear(); }},
      {"quad_first_face[0] is 1, expected 0", [](auto& l) { l.quad_first_face[0] = 1; }},
      {"quad_first_face[1] is 1, expected 2", [](auto& l) { l.quad_first_face[1] = 1; }},
      {"quad_first_face has 3 elements for 2 quads", [](auto& l) { l.quad_first_face.push_back(3); }},
      {"face_sggx has 2 elements for 3 faces", [](auto& l) { l.face_sggx.pop_back(); }},
      {"face_diffuse has 4 elements", [](auto& l) { l.face_diffuse.push_back({}); }},
      {"face_specular has 4 elements", [](auto& l) { l.face_specular.push_back({}), l.face_roughness2.push_back(1); }},
      {"face_transmission has 2 elements", [](auto& l) { l.face_transmission.pop_back(); }},
      {"face_specular and face_roughness2", [](auto& l) { l.face_roughness2.clear(); }},
      {"brick_table[1] is 5, expected 1 of 2", [](auto& l) { l.brick_table[1] = 5; }},
      {"brick_table[0] is 1, expected 0", [](auto& l) { std::swap(l.brick_table[0], l.brick_table[1]); }},
      {"brick_table[1] is 0, expected 1", [](auto& l) { l.brick_table[1] = 0; }},
      {"brick_table names 1 of 2 bricks", [](auto& l) { l.brick_table[1] = kNoBrick; }},
      {"brick_dims are 2 x 1 x 1 with 0 bricks", [](auto& l) { l.bricks.clear(); }},
      {"bricks[0] has density scale 0", [](auto& l) { l.bricks[0].density_scale = 0; }},
      {"bricks[1] has density scale nan", [](auto& l) { l.bricks[1].density_scale = NAN; }},
      {"bricks[1] has payload base 4, expected 3", [](auto& l) { l.bricks[1].payload_base = 4; }},
      {"bricks[1]: mask and densities differ", [](auto& l) { l.bricks[1].mask[7] |= uint64_t{1} << 63; }},
      {"bricks[1]: mask and densities differ", [](auto& l) { l.bricks[1].density[511] = 1; }},
      {"bricks[0] has prefix sum 65535, expected 2", [](auto& l) { l.bricks[0].prefix[3] = 0xffff; }},
      {"voxel_sggx has 6 elements for 5 voxels", [](auto& l) { l.voxel_sggx.push_back({}); }},
      {"voxel_diffuse has 4 elements", [](auto& l) { l.voxel_diffuse.pop_back(); }},
      {"voxel_specular and voxel_roughness2", [](auto& l) { l.voxel_specular.clear(); }},
      {"voxel_transmission has 4 elements", [](auto& l) { l.voxel_transmission.pop_back(); }},
      {"voxel_self_shadowing has 6 elements", [](auto& l) { l.voxel_self_shadowing.push_back(1); }},
      {"morph_vertex[0] is 4, and there are 4", [](auto& l) { l.morph_vertex[0] = 4; }},
      {"morph_vertex[2] is 4294967294", [](auto& l) { l.morph_vertex[2] = kMorphCollapsed; }},
      {"morph_face[4] is 3, and there are 3", [](auto& l) { l.morph_face[4] = 3; }},
      {"neither surface nor volume",
       [](auto& l) {
         const LevelHeader header = l.header;
         l = LevelData();
         l.header = header;
         l.header.brick_dims = {0, 0, 0};
       }},
  };
  const TemporaryFolder folder;
  for (const LevelCase& test_case : cases) {
    LevelData level = full_level();
    test_case.change(level);
    FileImage image(view_of(level));
    expect_refused(image, ErrorCode::BadFile, test_case.words, LevelCheck::Structure);
    const Result<uint64_t> written = write_level(folder.path() / "a.ffl", level);
    ASSERT_FALSE(written) << test_case.words;
    EXPECT_EQ(written.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(written.error().message.find(test_case.words), std::string::npos) << written.error().message;
  }
  EXPECT_TRUE(folder.names().empty());
}

TEST(HostileLevelFile, FullCheckFindsValuesThatMakeNoSense) {
  const std::vector<LevelCase> cases = {
      {"positions[2] = (nan,", [](auto& l) { l.positions[2].x = NAN; }},
      {"positions[3] = (", [](auto& l) { l.positions[3].z = INFINITY; }},
      {"positions[1] = (10", [](auto& l) { l.positions[1].x = 10.0f; }},
      {"bricks[0] has voxels outside the bounds", [](auto& l) { l.header.volume_origin.x += 2.5f; }},
      {"bricks[0]: reserved bytes", [](auto& l) { l.bricks[0].reserved[7] = 1; }},
      {"voxel_self_shadowing[3] is 0", [](auto& l) { l.voxel_self_shadowing[3] = 0; }},
  };
  const TemporaryFolder folder;
  for (const LevelCase& test_case : cases) {
    LevelData level = full_level();
    test_case.change(level);
    FileImage image(view_of(level));
    EXPECT_TRUE(parse(image, LevelCheck::Structure)) << test_case.words;
    expect_refused(image, ErrorCode::BadFile, test_case.words, LevelCheck::Full);
    EXPECT_FALSE(write_level(folder.path() / "a.ffl", level)) << test_case.words;
  }
}

TEST(HostileLevelFile, ChecksumErrorsNameTheSection) {
  const LevelLayout layout = layout_of(view_of(full_level()));
  for (const SectionEntry& section : layout.sections) {
    FileImage image(view_of(full_level()));
    const auto id = static_cast<SectionId>(section.id);
    if (id == SectionId::QuadFirstFace || id == SectionId::BrickTable) continue;  // no byte is free to change
    const size_t harmless = id == SectionId::Bricks ? 88 : 0;
    auto& byte = image.bytes()[section.offset + harmless];
    byte = byte == std::byte{2} ? std::byte{1} : std::byte{2};
    expect_refused(image, ErrorCode::BadFile, fmt::format("checksum of section {} ", section_name(id)),
                   LevelCheck::Full);
  }
}

TEST(LevelFile, AnythingButALevelFileIsAnError) {
  const TemporaryFolder folder;
  const auto code_of = [&](const char* name) {
    const auto file = LevelFile::open(folder.path() / name, LevelCheck::Structure);
    EXPECT_FALSE(file);
    EXPECT_NE(file.error().message.find(name), std::string::npos) << file.error().message;
    return file.error().code;
  };
  EXPECT_EQ(code_of("missing"), ErrorCode::NotFound);
  test::write_text(folder.path() / "empty", "");
  EXPECT_EQ(code_of("empty"), ErrorCode::BadFile);
  test::write_text(folder.path() / "text", std::string(5000, 'x'));
  EXPECT_EQ(code_of("text"), ErrorCode::BadFile);
  ASSERT_TRUE(write_level(folder.path() / "level", full_level()));
  std::filesystem::create_symlink(folder.path() / "level", folder.path() / "link");
  EXPECT_EQ(code_of("link"), ErrorCode::BadFile);
  std::filesystem::create_directory(folder.path() / "folder");
  EXPECT_EQ(code_of("folder"), ErrorCode::BadFile);
}

}  // namespace
}  // namespace farfield
