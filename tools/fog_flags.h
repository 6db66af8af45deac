// SPDX-License-Identifier: Apache-2.0
// Flags of commands that read OpenVDB files. Includes CLI11: only for the commands' .cpp files.
#pragma once

#include "bake/bake.h"
#include "tools/args.h"
#include "tools/flags.h"

namespace farfield::tool {

/// What the file does not say itself, for a command whose source may be a volume.
inline void add_fog_flags(CLI::App* command, FogOptions& fog) {
  command->add_option("--density-grid", fog.density_grid,
                      "OpenVDB: the grid that is the density. Without it \"density\", or the only fog volume");
  command
      ->add_option("--density-scale", fog.density_scale,
                   "OpenVDB: the attenuation coefficient, in 1 / scene unit, where the grid says 1")
      ->capture_default_str();
  add_parsed_option(command, "--albedo", fog.albedo, parse_albedo,
                    "OpenVDB: single-scattering albedo, grey or r,g,b. Without it the file's, or 0.99");
  command
      ->add_option("--anisotropy", fog.anisotropy,
                   "OpenVDB: mean cosine of scattering, above 0 forwards (Henyey-Greenstein)")
      ->capture_default_str();
  command
      ->add_option("--fibre-roughness", fog.fibre_roughness,
                   "OpenVDB: what fibres (a grid of directions) stop along themselves by what they stop across, 0 to 1")
      ->capture_default_str();
  command->add_flag("--level-set", fog.level_set, "OpenVDB: take a level set for the fog inside it");
}

inline void add_downsampling_flag(CLI::App* command, Downsampling& downsampling) {
  add_parsed_option(command, "--downsampling", downsampling, parse_downsampling,
                    "OpenVDB: how levels are made: linear, transp, iso, aniso, matched")
      ->default_str(name_of(downsampling));
}

}  // namespace farfield::tool
