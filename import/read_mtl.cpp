// SPDX-License-Identifier: Apache-2.0
#include "import/read_mtl.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/text.h"
#include "import/image_files.h"
#include "import/text_cursor.h"

namespace farfield {
namespace {

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// A word that is a number as a whole: a file name may start with digits.
std::optional<float> to_number(std::string_view word) {
  TextCursor cursor(word);
  double value = 0;
  if (word.empty() || !cursor.number(value) || !cursor.at_end()) return std::nullopt;
  return static_cast<float>(value);
}

std::string_view without_quotes(std::string_view name) {
  return name.size() >= 2 && name.front() == '"' && name.back() == '"' ? name.substr(1, name.size() - 2) : name;
}

/// Splits off the first word.
std::string_view take_word(std::string_view& rest) {
  TextCursor cursor(rest);
  const std::string_view word = cursor.word();
  cursor.skip_blanks();
  rest.remove_prefix(static_cast<size_t>(cursor.position() - rest.data()));
  return word;
}

/// How many words follow an option at most; those of numbers end at the first that is none.
int value_count(std::string_view option) {
  if (is_one_of(option, {"-o", "-s", "-t"})) return 3;
  if (option == "-mm") return 2;
  if (is_one_of(option, {"-blendu", "-blendv", "-cc", "-clamp", "-texres", "-imfchan", "-bm", "-boost", "-type",
                         "-colorspace"})) {
    return 1;
  }
  return 0;  // not an option of MTL
}

constexpr float kBrightestGlow = 1e9f;  // of what glows

class MtlReader {
 public:
  MtlReader(std::string_view text, const std::string& name) : text_(text), name_(name) {
    out_.is_from_blender = text.substr(0, 200).find("Blender") != std::string_view::npos;
  }

  MtlFile read() {
    for (line_ = 1; !text_.at_end(); ++line_) {
      std::string_view rest = text_.rest_of_line();
      keyword_ = take_word(rest);
      if (keyword_.empty() || keyword_.starts_with('#')) continue;
      read_line(lower_case(keyword_), rest);
    }
    return std::move(out_);
  }

 private:
  void read_line(const std::string& key, std::string_view rest) {
    if (key == "newmtl") {
      out_.materials.emplace_back().name = rest;
    } else if (out_.materials.empty()) {
      warn_once("stands before the first newmtl; ignored");
    } else if (!read_color_or_number(key, rest) && !read_map(key, rest) && !read_without_effect(key, rest)) {
      warn_once("is not known; ignored");
    }
  }

  MtlMaterial& material() { return out_.materials.back(); }

  bool read_color_or_number(const std::string& key, std::string_view rest) {
    MtlMaterial& m = material();
    if (key == "kd") return read_color(rest, m.kd);
    if (key == "ks") return read_color(rest, m.ks);
    if (key == "ke") return read_color(rest, m.ke, kBrightestGlow);
    if (key == "ns") return read_number(rest, m.ns);
    if (key == "tr") return read_number(rest, m.tr);
    if (key == "pr") return read_number(rest, m.pr);
    if (key == "pm") return read_number(rest, m.pm);
    if (key == "d") {
      if (rest.starts_with("-halo")) {
        take_word(rest);
        not_modelled("d -halo");
      }
      return read_number(rest, m.d);
    }
    if (key == "illum") {
      std::optional<float> model;
      read_number(rest, model);
      if (model && *model >= 0 && *model <= 10) m.illum = static_cast<int>(*model);
      return true;
    }
    if (key == "tf") {
      std::optional<vec3> filter;
      read_color(rest, filter);
      m.has_transmission_filter = filter && *filter != vec3(0.0f);
      return true;
    }
    return false;
  }

  /// Always true: the keyword is known, whatever follows it.
  bool read_number(std::string_view rest, std::optional<float>& value) {
    const auto number = to_number(take_word(rest));
    if (!number || std::isnan(*number)) {
      warn_once("is not followed by a number; ignored");
    } else {
      value = number;
    }
    return true;
  }

  /// One value is a grey. Values outside [0, most] are clamped.
  bool read_color(std::string_view rest, std::optional<vec3>& color, float most = 1) {
    vec3 value(0.0f);
    int count = 0;
    for (; count < 3; ++count) {
      const auto number = to_number(take_word(rest));
      if (!number || std::isnan(*number)) break;
      value[count] = std::clamp(*number, 0.0f, most);
      if (*number > most) not_modelled(fmt::format("{} above {}", keyword_, most));
    }
    if (count == 0 || count == 2) {
      warn_once("is not followed by one or three numbers; ignored");
    } else {
      color = count == 1 ? vec3(value.x) : value;
    }
    return true;
  }

  bool read_map(const std::string& key, std::string_view rest) {
    MtlMaterial& m = material();
    MtlMap* map = key == "map_kd"                                  ? &m.map_kd
                  : is_one_of(key, {"map_d", "map_opacity"})       ? &m.map_d
                  : is_one_of(key, {"map_tr", "map_transparency"}) ? &m.map_d
                  : key == "map_pr"                                ? &m.map_pr
                  : key == "map_pm"                                ? &m.map_pm
                  : is_one_of(key, {"map_ke", "map_emissive"})     ? &m.map_ke
                  : is_one_of(key, {"norm", "map_kn", "map_norm"}) ? &m.norm
                  : is_one_of(key, {"bump", "map_bump"})           ? &m.bump
                  : is_one_of(key, {"disp", "map_disp"})           ? &m.disp
                                                                   : nullptr;
    if (!map) return false;
    if (map == &m.map_d && key.starts_with("map_tr")) warn_once("is read as map_d: white is opaque");
    *map = {};
    while (rest.starts_with('-') && read_option(rest, *map)) {
    }
    std::string_view name = rest;
    // Some exporters write options behind the name.
    for (size_t at = rest.find(" -"); at != std::string_view::npos; at = rest.find(" -", at + 1)) {
      std::string_view options = rest.substr(at + 1), probe = options;
      if (value_count(take_word(probe)) == 0) continue;
      name = rest.substr(0, at);
      while (options.starts_with('-') && read_option(options, *map)) {
      }
      break;
    }
    map->file = without_quotes(name);
    if (map->file.empty()) warn_once("names no file; ignored");
    return true;
  }

  /// False, taking nothing, at what is no option: then it is a file name.
  bool read_option(std::string_view& rest, MtlMap& map) {
    std::string_view after = rest;
    const std::string option = lower_case(take_word(after));
    const int most = value_count(option);
    if (most == 0) return false;
    if (most > 1) {
      read_numbers(option, most, after, map);
    } else {
      const std::string value = lower_case(take_word(after));
      if (option == "-clamp")
        map.is_clamped = value == "on";
      else if (option == "-bm" && takes_scale(map))
        map.bump_scale = to_number(value).value_or(1);
      else if (option == "-imfchan" && takes_channel(map))
        map.channel = is_one_of(value, {"r", "g", "b", "m", "l"}) ? value[0] : 0;
      else if (!is_default(option, value))
        not_modelled(fmt::format("{} {}", keyword_, option));
    }
    rest = after;
    return true;
  }

  bool takes_scale(const MtlMap& map) {
    MtlMaterial& m = material();
    return &map == &m.bump || &map == &m.norm || &map == &m.disp;
  }

  bool takes_channel(const MtlMap& map) {
    MtlMaterial& m = material();
    return &map == &m.map_d || &map == &m.map_pr || &map == &m.map_pm || &map == &m.bump || &map == &m.disp;
  }

  void read_numbers(const std::string& option, int most, std::string_view& rest, MtlMap& map) {
    float values[3];
    int count = 0;
    for (std::string_view probe = rest; count < most; rest = probe) {
      const auto number = to_number(take_word(probe));
      if (!number || probe.empty()) break;  // the last word of the line is the file
      values[count++] = std::isfinite(*number) ? *number : 0.0f;
    }
    for (int c = 0; c < std::min(count, 2); ++c) {
      if (option == "-s") map.scale[c] = values[c];
      if (option == "-o") map.offset[c] = values[c];
    }
    if (option == "-mm" && &map == &material().disp && count == 2) {
      map.base = values[0];
      map.gain = values[1];
      return;
    }
    const bool is_neutral = option == "-mm" ? count == 2 && values[0] == 0 && values[1] == 1
                                            : std::all_of(values, values + count, [](float v) { return v == 0; });
    if (is_one_of(option, {"-t", "-mm"}) && !is_neutral) not_modelled(fmt::format("{} {}", keyword_, option));
  }

  static bool is_default(const std::string& option, const std::string& value) {
    if (is_one_of(option, {"-blendu", "-blendv"})) return value == "on";
    if (option == "-cc") return value == "off";
    if (option == "-bm") return value == "1" || value == "1.0";
    return false;
  }

  /// Ka is light that no path carries, Ni and sharpness belong to what is left out; further keywords are said with the
  /// material, unless they are zero.
  bool read_without_effect(const std::string& key, std::string_view rest) {
    if (is_one_of(key, {"ka", "ni", "sharpness", "pcr", "anisor"})) return true;
    if (key == "map_ka") {
      if (rest != material().map_kd.file) not_modelled(std::string(keyword_));
      return true;
    }
    if (is_one_of(key, {"km", "ps", "pc", "aniso"})) {
      bool is_zero = true;
      while (!rest.empty()) is_zero = to_number(take_word(rest)) == 0.0f && is_zero;
      if (!is_zero) not_modelled(std::string(keyword_));
      return true;
    }
    if (!is_one_of(key, {"map_ks", "map_ns", "decal", "refl", "map_refl", "map_ps", "map_pc", "map_rma", "map_orm",
                         "map_aat"})) {
      return false;
    }
    not_modelled(std::string(keyword_));
    return true;
  }

  void not_modelled(const std::string& what) {
    material().not_modelled.push_back(fmt::format("{} (line {})", what, line_));
  }

  /// Once per keyword and file, or a kit of a thousand materials says one thing a thousand times.
  void warn_once(std::string_view what) {
    const std::string said = fmt::format("{} {}", keyword_, what);
    if (said_.insert(said).second) out_.warnings.push_back(fmt::format("{}: line {}: {}", name_, line_, said));
  }

  TextCursor text_;
  const std::string& name_;
  MtlFile out_;
  int line_ = 0;
  std::string_view keyword_;
  std::set<std::string> said_;
};

}  // namespace

MtlFile read_mtl(std::string_view text, const std::string& name) {
  std::string storage;
  return MtlReader(with_line_ends(without_byte_order_mark(text), storage), name).read();
}

}  // namespace farfield
