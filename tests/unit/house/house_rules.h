// SPDX-License-Identifier: Apache-2.0
// Rules for the repository as a whole, on texts: the tests call them with the files, and with small made-up ones.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace farfield::house {

struct SourceFile {
  std::string name;  ///< relative to the repository: "bvh/level_scene.cpp"
  std::string text;
};

/// For each room (folder) the rooms that its sources may include, itself left out.
using Arrows = std::map<std::string, std::set<std::string>>;

/// Reads the table whose first column is headed "room" and whose last one is headed "may include". Rooms are in
/// backticks. Empty if there is no such table.
Arrows read_arrows(std::string_view markdown);

/// "FILE:LINE: ..." for each #include of a room that the arrows do not allow.
std::vector<std::string> find_forbidden_includes(const SourceFile& file, const Arrows& arrows);

/// "FILE:LINE: <embree3/...>" for each #include of Embree's own headers.
std::vector<std::string> find_embree_includes(const SourceFile& file);

/// "FILE:LINE: NAME" for each name of Embree's (rtcIntersect1, RTCRay, RTC_ERROR_NONE), in comments too.
std::vector<std::string> find_embree_names(const SourceFile& file);

/// "a -> b -> a" for a circle in the arrows; empty if there is none.
std::string find_circle(const Arrows& arrows);

/// "NAME: FILE:LINE and FILE:LINE" for each class, struct or enum that two files define with the same full name.
/// Types in unnamed namespaces and nested types do not count. Relies on clang-format: namespaces and their types start
/// in column 0, and "}  // namespace" ends one.
std::vector<std::string> find_doubled_types(const std::vector<SourceFile>& files);

/// "FILE: [KEY]" for each citation [Author Year] or [Author Year, place] whose **[Author Year]** is not in the list.
std::vector<std::string> find_unknown_citations(const SourceFile& file, std::string_view references);

/// "FILE: PATH" for each file of a room, of docs/ or of scripts/ that a text names in backticks, with its extension,
/// and that is not among `paths`.
std::vector<std::string> find_missing_paths(const SourceFile& file, const std::set<std::string>& paths);

/// "FILE: section N" for each "docs/theory.md, section N" (or N.M) that the theory does not have: sections are headed
/// "## N. ", parts begin with "**N.M " or are items "M. " of a section's list.
std::vector<std::string> find_unknown_sections(const SourceFile& file, const std::string& theory);

}  // namespace farfield::house
