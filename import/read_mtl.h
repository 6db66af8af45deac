// SPDX-License-Identifier: Apache-2.0
// MTL, as a file says it; what that means is decided in material_library.h. An own reader, because the usual ones lose
// what exporters write in other letters, with a byte order mark, or without Kd, and say nothing.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/vec.h"

namespace farfield {

/// A map_ line: the file and the options before (or, as some exporters write them, behind) its name.
struct MtlMap {
  std::string file;  ///< empty: there is none
  bool is_clamped = false;
  vec2 scale{1.0f}, offset{0.0f};  ///< -s and -o: uv * scale + offset, v up
  char channel = 0;                ///< -imfchan: r, g, b, m (alpha) or l (luminance); 0: not said
  float bump_scale = 1;            ///< -bm
  float base = 0, gain = 1;        ///< -mm: base + gain * texel; read of disp

  explicit operator bool() const { return !file.empty(); }
};

/// What is not set was not in the file.
struct MtlMaterial {
  std::string name;
  std::optional<vec3> kd, ks, ke;  ///< ke may exceed 1
  std::optional<float> ns, d, tr, pr, pm;
  std::optional<int> illum;
  MtlMap map_kd, map_d, map_pr, map_pm, map_ke, norm, bump, disp;
  bool has_transmission_filter = false;   ///< Tf is not black
  std::vector<std::string> not_modelled;  ///< keywords and options that were read and have no effect, with their lines
};

struct MtlFile {
  std::vector<MtlMaterial> materials;  ///< in the file's order; a name may come twice
  std::vector<std::string> warnings;   ///< one line each, with `name`, the line and the keyword
  bool is_from_blender = false;        ///< which means something else by Ks and Ns
};

/// Keywords in any case; a byte order mark is skipped. Never fails: a line that cannot be read is a warning.
/// `name` is for messages.
MtlFile read_mtl(std::string_view text, const std::string& name);

}  // namespace farfield
