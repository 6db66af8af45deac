// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/house/house_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>

namespace farfield::house {

namespace {

using Lines = std::vector<std::string>;

Lines lines_of(std::string_view text) {
  Lines lines;
  std::istringstream stream{std::string(text)};
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The words in backticks.
Lines quoted_words(const std::string& text) {
  static const std::regex quoted("`([a-z_]+)`");
  Lines words;
  for (std::sregex_iterator match(text.begin(), text.end(), quoted), end; match != end; ++match) {
    words.push_back((*match)[1]);
  }
  return words;
}

/// The room of what `file` includes: "farfield/ray.h" lies in include/, "../common/host.h" and "macros.h" are relative
/// to the includer.
std::string room_of_include(const std::string& path, const std::string& file) {
  const std::filesystem::path own_folder = std::filesystem::path(file).parent_path();
  const bool is_relative = path.starts_with("..") || path.find('/') == std::string::npos;
  const std::string from_root =
      (is_relative ? own_folder / path : std::filesystem::path(path)).lexically_normal().string();
  const std::string folder = from_root.substr(0, from_root.find('/'));
  return folder == "farfield" ? "include" : folder;
}

/// "FILE:LINE: MATCH" for all that matches, with the expression's first group as MATCH.
Lines find_in_lines(const SourceFile& file, const std::regex& expression) {
  Lines found;
  const Lines lines = lines_of(file.text);
  for (size_t i = 0; i < lines.size(); ++i) {
    for (std::sregex_iterator match(lines[i].begin(), lines[i].end(), expression), end; match != end; ++match) {
      found.push_back(fmt::format("{}:{}: {}", file.name, i + 1, (*match)[1].str()));
    }
  }
  return found;
}

/// Follows the arrows from the end of `path`; a circle's rooms, or nothing.
Lines circle_from(const Arrows& arrows, Lines path) {
  const auto next = arrows.find(path.back());
  if (next == arrows.end()) return {};
  for (const std::string& room : next->second) {
    const auto seen = std::ranges::find(path, room);
    const bool is_circle = seen != path.end();
    Lines longer(is_circle ? seen : path.begin(), path.end());
    longer.push_back(room);
    if (is_circle) return longer;
    if (Lines circle = circle_from(arrows, longer); !circle.empty()) return circle;
  }
  return {};
}

/// A type and where it is defined.
struct Definition {
  std::string type;  ///< with its namespaces
  std::string place;
};

std::vector<Definition> find_definitions(const SourceFile& file) {
  static const std::regex opens(R"(^(?:inline )?namespace ?([\w:]*) ?\{$)");
  static const std::regex type(
      R"(^(?:class|struct|union|enum(?: class)?) (?:alignas\(\w+\) |FARFIELD_API )*(\w+)(?![\w<:]).*)");
  std::vector<Definition> found;
  Lines namespaces;
  const Lines lines = lines_of(file.text);
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string& line = lines[i];
    std::smatch match;
    if (std::regex_match(line, match, opens)) {
      namespaces.push_back(match[1]);
    } else if (line.starts_with("}  // namespace") && !namespaces.empty()) {
      namespaces.pop_back();
    } else if (std::regex_match(line, match, type)) {
      const bool is_definition = line.find(';') == std::string::npos || line.find('{') != std::string::npos;
      const bool is_unnamed = std::ranges::find(namespaces, "") != namespaces.end();
      if (!is_definition || is_unnamed) continue;
      std::string name;
      for (const std::string& space : namespaces) name += space + "::";
      found.push_back({name + match[1].str(), fmt::format("{}:{}", file.name, i + 1)});
    }
  }
  return found;
}

/// Comments continue on the next line behind its "//": a citation may be broken there.
std::string join_lines(const std::string& text) {
  static const std::regex line_break(R"(\n *(?:///<|///|//|#)? *)");
  return std::regex_replace(text, line_break, " ");
}

}  // namespace

Arrows read_arrows(std::string_view markdown) {
  static const std::regex head(R"(^\| *room *\|.*\| *may include *\|$)");
  static const std::regex row(R"(^\|([^|]*)\|.*\|([^|]*)\|$)");
  Arrows arrows;
  bool is_in_table = false;
  for (const std::string& line : lines_of(markdown)) {
    std::smatch match;
    is_in_table = is_in_table ? line.starts_with('|') : std::regex_match(line, head);
    if (!is_in_table || !std::regex_match(line, match, row)) continue;
    const Lines room = quoted_words(match[1]), may_include = quoted_words(match[2]);
    if (!room.empty()) arrows[room.front()] = {may_include.begin(), may_include.end()};
  }
  return arrows;
}

std::vector<std::string> find_forbidden_includes(const SourceFile& file, const Arrows& arrows) {
  static const std::regex include(R"re(^ *# *include (?:"([^"]+)"|<(farfield/[^>]+)>).*)re");
  const std::string own_room = file.name.substr(0, file.name.find('/'));
  const auto allowed = arrows.find(own_room);
  if (allowed == arrows.end()) return {fmt::format("{}: {} is not in the table of rooms", file.name, own_room)};
  std::vector<std::string> problems;
  const Lines lines = lines_of(file.text);
  for (size_t i = 0; i < lines.size(); ++i) {
    std::smatch match;
    if (!std::regex_match(lines[i], match, include)) continue;
    const std::string path = match[1].matched ? match[1] : match[2];
    const std::string room = room_of_include(path, file.name);
    if (room == own_room || allowed->second.contains(room)) continue;
    problems.push_back(fmt::format("{}:{}: {} may not include {} (\"{}\")", file.name, i + 1, own_room, room, path));
  }
  return problems;
}

std::vector<std::string> find_embree_includes(const SourceFile& file) {
  static const std::regex include(R"(^ *# *include ([<"]embree\d*/[^>"]+[>"]))");
  return find_in_lines(file, include);
}

std::vector<std::string> find_embree_names(const SourceFile& file) {
  static const std::regex name(R"(\b(rtc[A-Z]\w*|RTC[A-Z_]\w*))");
  return find_in_lines(file, name);
}

std::string find_circle(const Arrows& arrows) {
  for (const auto& [room, unused] : arrows) {
    const Lines circle = circle_from(arrows, {room});
    if (!circle.empty()) return fmt::format("{}", fmt::join(circle, " -> "));
  }
  return {};
}

std::vector<std::string> find_doubled_types(const std::vector<SourceFile>& files) {
  std::map<std::string, std::string> first_place;
  std::vector<std::string> problems;
  for (const SourceFile& file : files) {
    for (const auto& [type, place] : find_definitions(file)) {
      const auto [first, is_new] = first_place.try_emplace(type, place);
      if (!is_new) problems.push_back(fmt::format("{}: {} and {}", type, first->second, place));
    }
  }
  return problems;
}

std::vector<std::string> find_unknown_citations(const SourceFile& file, std::string_view references) {
  static const std::regex citation(
      R"(\[([A-Z][^\[\](){}<>=;:"| 0-9][^\[\](){}<>=;:"|0-9]{0,80} [12][0-9]{3})(?:, [^\[\]]{1,60})?\])");
  const std::string text = join_lines(file.text);
  std::vector<std::string> problems;
  for (std::sregex_iterator match(text.begin(), text.end(), citation), end; match != end; ++match) {
    const std::string entry = fmt::format("**[{}]**", (*match)[1].str());
    if (references.find(entry) == std::string_view::npos) problems.push_back(file.name + ": " + match->str());
  }
  return problems;
}

std::vector<std::string> find_missing_paths(const SourceFile& file, const std::set<std::string>& paths) {
  static const std::regex path(R"(`([a-z_]+/[a-z0-9_/.-]+\.(?:h|cpp|cmake|md|py|txt)))");
  std::vector<std::string> problems;
  for (std::sregex_iterator match(file.text.begin(), file.text.end(), path), end; match != end; ++match) {
    const std::string named = (*match)[1];
    const bool is_header = named.starts_with("farfield/");
    if (!paths.contains(is_header ? "include/" + named : named)) problems.push_back(file.name + ": " + named);
  }
  return problems;
}

std::vector<std::string> find_unknown_sections(const SourceFile& file, const std::string& theory) {
  static const std::regex citation(R"(docs/theory\.md, sections? (\d+)(?:\.(\d+))?(?: and (\d+)(?:\.(\d+))?)?)");
  const auto has = [&](const std::string& section, const std::string& part) {
    const size_t begin = theory.find("\n## " + section + ". ");
    if (begin == std::string::npos) return false;
    const std::string body = theory.substr(begin, theory.find("\n## ", begin + 1) - begin);
    return part.empty() || body.find("\n**" + section + "." + part + " ") != std::string::npos ||
           body.find("\n" + part + ". ") != std::string::npos;
  };
  const std::string text = join_lines(file.text);
  std::vector<std::string> problems;
  for (std::sregex_iterator match(text.begin(), text.end(), citation), end; match != end; ++match) {
    const bool is_known = has((*match)[1], (*match)[2]) && (!(*match)[3].matched || has((*match)[3], (*match)[4]));
    if (!is_known) problems.push_back(file.name + ": " + match->str());
  }
  return problems;
}

}  // namespace farfield::house
