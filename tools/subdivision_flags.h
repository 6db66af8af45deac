// SPDX-License-Identifier: Apache-2.0
// Flags of commands that read meshes, which may be subdivision cages. Includes CLI11: only for the commands' .cpp
// files.
#pragma once

#include "bake/bake.h"
#include "import/subdivision_options.h"
#include "tools/args.h"
#include "tools/flags.h"

namespace farfield::tool {

/// Which part of a glTF file: a mesh or a node; and which tile of that, or of any model.
inline void add_part_flags(CLI::App* command, ImportOptions& options, const char* mesh_help, const char* node_help) {
  CLI::Option* mesh = command->add_option("--mesh", options.mesh, mesh_help)->check(CLI::Range(0, 1 << 20));
  command->add_option("--node", options.node, node_help)->check(CLI::Range(0, 1 << 30))->excludes(mesh);
  const auto parse_tile = [](const std::string& text) -> Result<MeshTile> {
    const auto part = parse_part(text);
    if (!part) return tl::unexpected(part.error());
    return MeshTile{part->number, part->count};
  };
  add_parsed_option(command, "--tile", options.tile, parse_tile,
                    "Only tile I of the N that it is cut into, I/N: as render and shot bake grounds of a scene")
      ->default_str("0/1");
}

/// What a mesh does not say itself.
inline void add_subdivision_flags(CLI::App* command, SubdivisionOptions& options) {
  CLI::Option* scheme =
      add_parsed_option(
          command, "--subdivide", options.scheme, parse_subdivision_scheme,
          "Meshes are cages of smooth surfaces: catmull-clark, or loop (triangles only); none: as they are. Meshes "
          "of glTF that say their own (extras \"farfield_subdivision\") are that")
          ->default_str("none");
  command
      ->add_option("--subdivide-error", options.error,
                   "How far faces may lie from the smooth or displaced surface, in voxels of level 0 (half of level "
                   "1's)")
      ->capture_default_str();
  command
      ->add_option(
          "--displace-detail", options.detail,
          "Displacement maps (disp of MTL) are means over this much, in such voxels, and cut no finer for their "
          "sake")
      ->capture_default_str();
  command->add_flag("!--no-displacement", options.displace, "Displacement maps change nothing");
  command
      ->add_option("--subdivide-edge", options.edge,
                   "The longest that sides of faces may be, in such voxels; 0: as the error allows")
      ->capture_default_str()
      ->needs(scheme);
  add_parsed_option(command, "--subdivide-boundary", options.boundary, parse_cage_boundary,
                    "Rims of open cages: edge-and-corner or edge-only. Without it the file's own, or edge-and-corner")
      ->needs(scheme);
  add_parsed_option(command, "--subdivide-uv", options.uv, parse_cage_uv,
                    "Where texture coordinates stay linear: none, corners-only, corners-plus1, corners-plus2, "
                    "boundaries, all. Without it the file's own, or corners-plus1")
      ->needs(scheme);
}

/// How levels of meshes are made.
inline CLI::Option* add_simplify_flag(CLI::App* command, SimplifyMethod& method) {
  return add_parsed_option(command, "--simplify", method, parse_simplify_method,
                           "What collapses on coarser levels: loops (of quads, which stay quads; edges of other "
                           "faces), edges (of all faces), auto (loops of well-structured parts, edges of the others)")
      ->default_str(name_of(method));
}

}  // namespace farfield::tool
