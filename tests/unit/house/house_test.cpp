// SPDX-License-Identifier: Apache-2.0
// The repository against its own documents: arrows between rooms, one name per type, citations.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/unit/house/house_rules.h"

namespace farfield::house {
namespace {

namespace fs = std::filesystem;
using Problems = std::vector<std::string>;

const fs::path kRepository = FARFIELD_SOURCE_DIR;

std::string read(const fs::path& path) {
  std::ifstream stream(path);
  EXPECT_TRUE(stream) << path;
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Files of one folder with one of the extensions, in alphabetical order.
std::vector<SourceFile> files_in(const std::string& folder, const std::set<std::string>& extensions) {
  std::vector<SourceFile> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRepository / folder)) {
    if (!extensions.contains(entry.path().extension())) continue;
    files.push_back({fs::relative(entry.path(), kRepository), read(entry.path())});
  }
  std::ranges::sort(files, {}, &SourceFile::name);
  return files;
}

Arrows documented_arrows() { return read_arrows(read(kRepository / "docs/architecture.md")); }

std::vector<SourceFile> all_sources() {
  std::vector<SourceFile> files;
  for (const auto& [room, unused] : documented_arrows())
    std::ranges::move(files_in(room, {".h", ".cpp"}), std::back_inserter(files));
  return files;
}

void append(Problems& all, const Problems& more) { all.insert(all.end(), more.begin(), more.end()); }

std::string list(const Problems& problems) { return fmt::format("{}", fmt::join(problems, "\n")); }

// ---- the repository ----

TEST(House, EveryFolderWithSourcesIsARoomOfTheTable) {
  const Arrows arrows = documented_arrows();
  for (const auto& entry : fs::directory_iterator(kRepository)) {
    const std::string folder = entry.path().filename();
    if (!fs::exists(entry.path() / "CMakeLists.txt") || folder.starts_with("build")) continue;
    EXPECT_TRUE(arrows.contains(folder)) << folder << " is missing in docs/architecture.md";
  }
  for (const auto& [room, unused] : arrows) EXPECT_TRUE(fs::exists(kRepository / room)) << room << " does not exist";
}

TEST(House, RoomsIncludeOnlyWhatTheTableAllows) {
  const Arrows arrows = documented_arrows();
  const std::vector<SourceFile> sources = all_sources();
  ASSERT_GT(sources.size(), 200u) << "the folders are not where they were";
  Problems problems;
  for (const SourceFile& file : sources) append(problems, find_forbidden_includes(file, arrows));
  EXPECT_EQ(list(problems), "") << "see the table of rooms in docs/architecture.md";
}

/// Who may use Embree's own names: a move to another version of Embree is made in these files.
const std::set<std::string> kMayNameEmbree = {
    // its names for all others
    "base/embree.cpp",
    "base/embree.h",
    // the callbacks, with Embree's arguments
    "bvh/instance_geometry.cpp",
    "bvh/instance_geometry.h",
    "bvh/part_scenes.cpp",
    "bvh/part_scenes.h",
    // what hosts see, and its definitions
    "include/farfield/farfield.h",
    "include/farfield/ray.h",
    "include/farfield/runtime.h",
    "runtime/c_api.cpp",
    "runtime/interaction.cpp",
    "runtime/interaction_model.h",
    "runtime/runtime.cpp",
    // Embree's own instances, to compare with; packets and streams
    "tests/unit/bvh/instance_geometry_test.cpp",
    // scenes and contexts as they should not be
    "tests/unit/runtime/runtime_test.cpp",
};

/// Hosts call Embree as they like, and the rules' tests break the rules.
bool is_free_to_name_embree(const std::string& file) {
  return kMayNameEmbree.contains(file) || file.starts_with("samples/") || file.starts_with("tests/unit/house/");
}

TEST(House, EmbreeIsIncludedInOnePlace) {
  Problems includes;
  for (const SourceFile& file : all_sources()) append(includes, find_embree_includes(file));
  EXPECT_EQ(list(includes), "include/farfield/embree.h:5: <embree3/rtcore.h>") << "include farfield/embree.h";
}

TEST(House, FewFilesUseEmbreesNames) {
  Problems problems;
  std::set<std::string> unused = kMayNameEmbree;
  for (const SourceFile& file : all_sources()) {
    const Problems names = find_embree_names(file);
    if (!names.empty()) unused.erase(file.name);
    if (!is_free_to_name_embree(file.name)) append(problems, names);
  }
  EXPECT_EQ(list(problems), "") << "use base/embree.h";
  EXPECT_EQ(unused, std::set<std::string>()) << "these need not be in the list";
}

TEST(House, ArrowsOfTheTableHaveNoCircle) { EXPECT_EQ(find_circle(documented_arrows()), ""); }

TEST(House, NoTypeNameIsDefinedTwice) {
  EXPECT_EQ(list(find_doubled_types(all_sources())), "")
      << "two types of one name in one program are undefined "
         "behaviour: rename one, or put it into an unnamed namespace";
}

/// What people read: sources, scripts, documents. Not these tests, whose made-up texts break the rules.
std::vector<SourceFile> all_texts() {
  std::vector<SourceFile> files = all_sources();
  std::ranges::move(files_in("scripts", {".py"}), std::back_inserter(files));
  std::ranges::move(files_in("docs", {".md"}), std::back_inserter(files));
  for (const char* name : {"README.md", "CONTRIBUTING.md"}) files.push_back({name, read(kRepository / name)});
  std::erase_if(files, [](const SourceFile& file) { return file.name.starts_with("tests/unit/house/"); });
  return files;
}

TEST(House, EveryCitationIsInTheReferences) {
  const std::string references = read(kRepository / "docs/references.md");
  Problems problems;
  for (const SourceFile& file : all_texts()) append(problems, find_unknown_citations(file, references));
  EXPECT_EQ(list(problems), "") << "add them to docs/references.md";
}

TEST(House, SamplesThatFollowPathsAddWhatHitsEmit) {
  size_t tracers = 0;
  for (const SourceFile& sample : files_in("samples", {".cpp"})) {
    if (sample.text.find("throughput *= ") == std::string::npos) continue;
    ++tracers;
    EXPECT_NE(sample.text.find("throughput * interaction.emission"), std::string::npos) << sample.name;
  }
  EXPECT_GT(tracers, 0u);
}

TEST(House, DocumentsNameFilesAndSectionsThatExist) {
  std::set<std::string> paths;
  for (const auto& [room, unused] : documented_arrows()) {
    for (const SourceFile& file : files_in(room, {".h", ".cpp", ".cmake", ".txt", ".py"})) paths.insert(file.name);
  }
  for (const char* folder : {"docs", "scripts"}) {
    for (const SourceFile& file : files_in(folder, {".md", ".py", ".txt"})) paths.insert(file.name);
  }
  const std::string theory = read(kRepository / "docs/theory.md");
  Problems problems;
  for (const SourceFile& file : all_texts()) {
    if (file.name.ends_with(".md")) append(problems, find_missing_paths(file, paths));
    append(problems, find_unknown_sections(file, theory));
  }
  EXPECT_EQ(list(problems), "");
}

// ---- the rules ----

TEST(HouseRules, ReadTheRoomsFromTheTable) {
  const char* text =
      "| word | meaning |\n|---|---|\n| `light` | what it is |\n\n"
      "| room | what it knows | may include |\n|---|---|---|\n"
      "| `ground` | `nothing` | |\n| `cellar` | all `else` | `ground`, `well` |\n\n| `garden` | | `ground` |\n";
  EXPECT_EQ(read_arrows(text), (Arrows{{"ground", {}}, {"cellar", {"ground", "well"}}}));
}

TEST(HouseRules, FindAnIncludeAgainstTheArrows) {
  const Arrows arrows = {{"roof", {"walls"}}, {"walls", {"include"}}};
  const SourceFile good{"walls/brick.cpp",
                        "#include \"walls/brick.h\"\n#include \"clay.h\"\n#include <vector>\n"
                        "#include \"farfield/ray.h\"\n#include <farfield/ray.h>\n// roof/tile.h\n"};
  EXPECT_EQ(find_forbidden_includes(good, arrows), Problems{});
  const SourceFile bad{"walls/brick.cpp", "\n#include \"roof/tile.h\"\n#include \"cellar/wine.h\"  // why\n"};
  EXPECT_EQ(find_forbidden_includes(bad, arrows),
            (Problems{"walls/brick.cpp:2: walls may not include roof (\"roof/tile.h\")",
                      "walls/brick.cpp:3: walls may not include cellar (\"cellar/wine.h\")"}));
  EXPECT_EQ(find_forbidden_includes({"roof/tile.h", "#include <farfield/ray.h>"}, arrows),
            (Problems{"roof/tile.h:1: roof may not include include (\"farfield/ray.h\")"}));
  EXPECT_EQ(find_forbidden_includes({"roof/slate/tile.h", "#include \"../nail.h\"\n#include \"grain.h\""}, arrows),
            Problems{});
  EXPECT_EQ(find_forbidden_includes({"roof/tile.h", "#include \"../attic/box.h\""}, arrows).size(), 1u);
  EXPECT_EQ(find_forbidden_includes({"shed/rake.h", ""}, arrows).size(), 1u);
}

TEST(HouseRules, FindWhereEmbreeIsIncludedAndNamed) {
  const SourceFile clean{"a.h", "#include \"base/embree.h\"\n#include <farfield/embree.h>\nEmbreeRay artcOne, RTC;\n"};
  EXPECT_EQ(find_embree_includes(clean), Problems{});
  EXPECT_EQ(find_embree_names(clean), Problems{});
  EXPECT_EQ(
      find_embree_includes({"a.h", "\n#include <embree3/rtcore.h>  // why\n# include \"embree4/rtcore_ray.h\"\n"}),
      (Problems{"a.h:2: <embree3/rtcore.h>", "a.h:3: \"embree4/rtcore_ray.h\""}));
  EXPECT_EQ(find_embree_names({"a.h", "\nRTCRay ray = rtcRay(RTC_NONE);\n// as rtcIntersect1 does\n"}),
            (Problems{"a.h:2: RTCRay", "a.h:2: rtcRay", "a.h:2: RTC_NONE", "a.h:3: rtcIntersect1"}));
}

TEST(HouseRules, FindACircle) {
  EXPECT_EQ(find_circle({{"a", {"b", "c"}}, {"b", {"c"}}, {"c", {}}}), "");
  EXPECT_EQ(find_circle({{"a", {"b"}}, {"b", {"c"}}, {"c", {"d"}}, {"d", {"b"}}}), "b -> c -> d -> b");
  EXPECT_EQ(find_circle({{"a", {"a"}}}), "a -> a");
}

TEST(HouseRules, FindTypesOfOneName) {
  const auto in = [](const char* space, const char* body) {
    return fmt::format("namespace {} {{\n\n{}\n}}  // namespace {}\n", space, body, space);
  };
  const SourceFile first{"a.h", in("farfield", "class Image {\n};\nenum class Kind : int { A };\nstruct Later;\n")};
  EXPECT_EQ(find_doubled_types(
                {first, {"b.h", in("farfield", "template <typename T>\nclass FARFIELD_API Image final {\n};\n")}}),
            Problems{"farfield::Image: a.h:3 and b.h:4"});
  EXPECT_EQ(find_doubled_types(
                {first, {"b.h", in("farfield", "enum class Kind { B };\nstruct alignas(64) Later\n    : X {\n};\n")}}),
            Problems{"farfield::Kind: a.h:5 and b.h:3"});
  for (const char* harmless :
       {"class Image;  // later\n", "template <template <typename> class Image>\nvoid f();\n",
        "namespace {\nclass Image {\n};\n}  // namespace\n", "struct Outer {\n  struct Image {};\n};\n",
        "struct Image::Part {\n};\n", "// class Image {\n"}) {
    EXPECT_EQ(find_doubled_types({first, {"b.h", in("farfield", harmless)}}), Problems{}) << harmless;
  }
  EXPECT_EQ(find_doubled_types({first, {"b.h", in("farfield::tool", "class Image {\n};\n")}}), Problems{});
}

TEST(HouseRules, FindACitationWithoutEntry) {
  const char* references = "- **[Loubet 2018]** G. Loubet\n- **[Carlson 1995]** B. C. Carlson\n";
  EXPECT_EQ(
      find_unknown_citations({"a.h", "// [Loubet 2018], [Loubet 2018, 8.2] and [Carlson\n  /// 1995]."}, references),
      Problems{});
  EXPECT_EQ(find_unknown_citations({"a.h", "/// by [Steele, Lea and\n/// Flood 2014, 3], not x[N - 1000]"}, references),
            Problems{"a.h: [Steele, Lea and Flood 2014, 3]"});
}

TEST(HouseRules, FindPathsAndSectionsThatAreNot) {
  const std::set<std::string> paths = {"bvh/a.h", "include/farfield/ray.h"};
  EXPECT_EQ(find_missing_paths({"d.md", "`bvh/a.h` (`farfield/ray.h`), `host.cpp`, `bvh/b.h` [`cache/c.cpp`]"}, paths),
            (Problems{"d.md: bvh/b.h", "d.md: cache/c.cpp"}));
  const std::string theory = "# Theory\n\n## 1. Light\n\n**1.2 More.** x\n\n## 2. Numbers\n\n3. **Three**\n";
  EXPECT_EQ(
      find_unknown_sections({"a.h", "docs/theory.md, section 1, docs/theory.md,\n// sections 1.2 and 2.3)"}, theory),
      Problems{});
  EXPECT_EQ(find_unknown_sections({"a.h", "docs/theory.md, section 3; docs/theory.md, section 1.3"}, theory),
            (Problems{"a.h: docs/theory.md, section 3", "a.h: docs/theory.md, section 1.3"}));
  EXPECT_EQ(find_unknown_sections({"a.h", "docs/theory.md, sections 1 and 2.2"}, theory).size(), 1u);
}

}  // namespace
}  // namespace farfield::house
