// SPDX-License-Identifier: Apache-2.0
// `farfield analyse`: what the bake decides about a mesh at each resolution, before anything is voxelised: surface or
// sub-resolution geometry (thesis fig. 7.5), how large faces become, and how rough (fig. 8.6).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "base/job.h"
#include "base/result.h"
#include "evaluate/simplifier_comparison.h"
#include "path_tracer/image.h"

namespace farfield {

struct AnalyseOptions {
  std::filesystem::path source;  ///< a mesh
  BakeOptions bake;              ///< grids, import and simplification as given to the bake; its job is this one's
  bool compare = false;          ///< hold each level's simplification against others'
  int view = 0;                  ///< of the pictures: the number of one of view_directions(12)
  int cell_px = 0;               ///< longest side of a picture; 0: none is made
};

/// The middle and the 95 % point of a number over the faces, weighted by area.
struct Spread {
  double median = 0, most = 0;
};

struct LevelAnalysis {
  uint32_t level = 0, grid = 0;
  double resolution = 0;                       ///< r_k, scene units
  uint64_t faces_before = 0;                   ///< of the macrosurface
  uint64_t faces = 0;                          ///< the same, simplified
  uint64_t sub_resolution = 0;                 ///< faces that become voxels
  double macrosurface_share = 0;               ///< of the area of all faces, before simplification; in [0, 1]
  Spread face_size;                            ///< longest side of the simplified faces, in r_k
  double normal_roughness = 0;                 ///< mean over their area of normal_roughness()
  std::vector<SimplifierFigures> simplifiers;  ///< if they were compared and there is a macrosurface
  std::vector<Image> pictures;                 ///< if asked for: analysis, face sizes, roughness; R, G, B
};

struct Analysis {
  std::vector<LevelAnalysis> levels;     ///< finest first
  std::vector<uint32_t> grids_not_made;  ///< whose levels would take more than the source
  std::vector<std::string> warnings;     ///< of the import and of the bake, one line each
};

/// Roughness alpha of the distribution of a face's normals, as the GGX lobe of a mirror with such facets has it: 0
/// where all are `normal`, the root of the mean of alpha^2 along both tangents elsewhere; at most 1.
float normal_roughness(const FaceMaterial& material, const vec3& normal);

/// Runs the bake as far as its surfaces. The result does not depend on the number of threads. Errors: those of bake();
/// Unsupported (a volume); InvalidArgument (no such view); Cancelled.
Result<Analysis> analyse(const AnalyseOptions& options);

/// One row of pictures per level, with its figures and the scales of the colours; linear R, G, B. No pictures: an empty
/// image.
Image analysis_sheet(const Analysis& analysis);

std::string to_json(const Analysis& analysis);

}  // namespace farfield
