// SPDX-License-Identifier: Apache-2.0
// farfield/bake.h over the rooms that do the work.
#include <fmt/format.h>

#include <new>

#include "bake/bake.h"
#include "bake_api/gather_mesh.h"
#include "bake_api/gather_volume.h"
#include "bake_api/memory_guard.h"
#include "bake_api/source_from_input.h"
#include "base/bytes.h"
#include "base/parallel.h"
#include "base/result.h"
#include "farfield/bake.h"
#include "prefilter/subdivide.h"

namespace farfield {
namespace {

Downsampling downsampling_of(BakeDownsampling method) {
  switch (method) {
    case BakeDownsampling::Linear:
      return Downsampling::Linear;
    case BakeDownsampling::Transp:
      return Downsampling::Transp;
    case BakeDownsampling::Iso:
      return Downsampling::Iso;
    case BakeDownsampling::Aniso:
      return Downsampling::Aniso;
    case BakeDownsampling::Matched:
      return Downsampling::Matched;
  }
  return Downsampling::Matched;
}

/// Schemes and rules have the same order there and here; a number that is none of them is refused.
Result<SubdivisionOptions> subdivision_options(const BakeSubdivision& subdivision) {
  if (subdivision.scheme > BakeSubdivision::Scheme::Loop ||
      subdivision.boundary > BakeSubdivision::Boundary::EdgeOnly || subdivision.uv > BakeSubdivision::Uv::All) {
    return make_error(ErrorCode::InvalidArgument, "bake: a subdivision with a scheme or rule that does not exist");
  }
  SubdivisionOptions options;
  options.scheme = static_cast<SubdivisionScheme>(subdivision.scheme);
  if (subdivision.boundary != BakeSubdivision::Boundary::EdgeAndCorner) {
    options.boundary = static_cast<CageBoundary>(subdivision.boundary);
  }
  if (subdivision.uv != BakeSubdivision::Uv::CornersPlus1) options.uv = static_cast<CageUv>(subdivision.uv);
  options.error = subdivision.error;
  options.edge = subdivision.edge;
  options.detail = subdivision.detail;
  return options;
}
static_assert(static_cast<int>(BakeSubdivision::Scheme::Loop) == static_cast<int>(SubdivisionScheme::Loop));
static_assert(static_cast<int>(BakeSubdivision::Boundary::EdgeOnly) == static_cast<int>(CageBoundary::EdgeOnly));
static_assert(static_cast<int>(BakeSubdivision::Uv::All) == static_cast<int>(CageUv::All));

/// The same of methods.
Result<SimplifyMethod> simplify_method(BakeSimplify method) {
  if (method > BakeSimplify::Edges)
    return make_error(ErrorCode::InvalidArgument, "bake: a way to simplify that does not exist");
  return static_cast<SimplifyMethod>(method);
}
static_assert(static_cast<int>(BakeSimplify::Loops) == static_cast<int>(SimplifyMethod::Loops));
static_assert(static_cast<int>(BakeSimplify::Edges) == static_cast<int>(SimplifyMethod::Edges));

BakeOptions bake_options(const BakeSettings& settings, const MemoryGuard& guard) {
  BakeOptions options;
  options.finest_grid = settings.finest_grid;
  options.coarsest_grid = settings.coarsest_grid;
  options.rays_per_voxel = settings.rays_per_voxel;
  options.source_only = settings.source_only;
  options.import.fog = fog_options(settings.fog);
  options.downsampling = downsampling_of(settings.downsampling);
  options.job.cancel = guard.cancel();
  if (settings.progress) {
    // Voxels are counted by whichever thread did them.
    options.job.progress = [&settings, mutex = std::make_shared<std::mutex>()](double done, const std::string& stage) {
      const std::lock_guard lock(*mutex);
      settings.progress(done, stage);
    };
  }
  return options;
}

BakeSummary summary_of(const BakeReport& report) {
  BakeSummary summary;
  for (const LevelEntry& entry : report.manifest.levels) {
    summary.levels.push_back({entry.level, entry.grid, entry.resolution, entry.triangles, entry.voxels,
                              entry.file_bytes, entry.resident_bytes});
  }
  summary.warnings = report.warnings;
  summary.seconds = report.total_seconds;
  summary.is_up_to_date = report.up_to_date;
  return summary;
}

tl::unexpected<Error> out_of_memory(const std::string& needed, std::vector<std::string> warnings) {
  return tl::unexpected<Error>(
      Error{ErrorCode::OutOfBudget,
            "bake: " + needed + "; allow more memory, lower the finest grid, or bake the input in parts",
            std::move(warnings)});
}

/// Runs a bake within the settings' limits, and says it as one of those if it was ended by one.
template <typename Run>
Result<BakeSummary> run_limited(const BakeSettings& settings, const Run& run) {
  if (settings.threads < 0) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("bake: {} threads", settings.threads));
  }
  FARFIELD_TRY_LET(const auto subdivision, subdivision_options(settings.subdivision));
  FARFIELD_TRY_LET(const auto simplify, simplify_method(settings.simplify));
  const ThreadLimit threads(settings.threads);
  const MemoryGuard guard(settings.memory_limit_bytes, settings.cancel);
  try {
    BakeOptions options = bake_options(settings, guard);
    options.import.subdivision = subdivision;
    options.simplify = simplify;
    const Result<BakeReport> report = run(std::move(options));
    if (report) return summary_of(*report);
    if (report.error().code == ErrorCode::Cancelled && guard.exceeded_bytes() > 0) {
      return out_of_memory(fmt::format("it took {} where {} are allowed", format_bytes(guard.exceeded_bytes()),
                                       format_bytes(settings.memory_limit_bytes)),
                           report.error().warnings);
    }
    return tl::unexpected(report.error());
  } catch (const ScratchFull& full) {
    return tl::unexpected(full.error);
  } catch (const std::bad_alloc&) {
    return out_of_memory("the system has no more memory", {});
  }
}

}  // namespace

Result<BakeSummary> bake_meshes(const BakeInput& input, const std::string& folder, const BakeSettings& settings) {
  return run_limited(settings, [&](BakeOptions options) -> Result<BakeReport> {
    options.job.report(0, "import");
    FARFIELD_TRY_LET(SourceMesh cage, source_from_input(input, options.job.quiet()));
    FARFIELD_TRY_LET(SourceMesh mesh,
                     subdivide(std::move(cage), import_options(options).subdivision, input.name, options.job.quiet()));
    FARFIELD_TRY_LET(ImportedAsset asset, condition(std::move(mesh), input.name, options.job.quiet()));
    // What a function answers is not in the hash.
    options.even_if_up_to_date = has_material_function(input) && input.material_key.empty();
    return bake(std::move(asset), input.name, folder, options);
  });
}

Result<BakeSummary> bake_volume(const BakeVolume& volume, const std::string& folder, const BakeSettings& settings) {
  return run_limited(settings, [&](const BakeOptions& options) -> Result<BakeReport> {
    options.job.report(0, "import");
    FARFIELD_TRY_LET(SourceVolume source, gather_volume(volume, settings.fog, options.job.quiet()));
    return bake(std::move(source), volume.name, folder, options);
  });
}

Result<BakeSummary> bake_file(const std::string& source, const std::string& folder, const BakeSettings& settings,
                              int mesh) {
  return run_limited(settings, [&](BakeOptions options) -> Result<BakeReport> {
    options.import.mesh = mesh;
    return bake(source, folder, options);
  });
}

}  // namespace farfield
