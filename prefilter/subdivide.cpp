// SPDX-License-Identifier: Apache-2.0
// Each face of the cage is tessellated in the pattern that OpenSubdiv's Bfr::Tessellation gives for its rates:
//
//     v3 ---- e ---- v2      v: the cage's points, one vertex each
//     |  \  |  |  /  |       e: points of an edge, evaluated by one of its faces, used by all
//     e -- i ---- i -- e     i: inside, the face's own
//     |  /  |  |  \  |
//     v0 - e -- e -- v1      What lies at corners (normal, uv, colour) is always the face's own.
#include "prefilter/subdivide.h"

#include <fmt/format.h>
#include <opensubdiv/bfr/tessellation.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/index.h"
#include "base/parallel.h"
#include "prefilter/cage.h"
#include "prefilter/limit_surface.h"
#include "prefilter/tessellation_rates.h"

namespace farfield {
namespace {

namespace osd = OpenSubdiv;
using glm::dvec2;
using osd::Bfr::Tessellation;

constexpr size_t kGrain = 16;  // faces of the cage at once

tl::unexpected<Error> cancelled() { return make_error(ErrorCode::Cancelled, "import: cancelled"); }

/// The pattern of a face.
Tessellation pattern_of(const LimitSurface& surface, const TessellationRates& rates, int face) {
  const auto edges = surface.topology().GetFaceEdges(face);
  const osd::Bfr::Parameterization parameters(surface.scheme(), edges.size());
  std::vector<int> all;
  for (int i = 0; i < edges.size(); ++i) all.push_back(rates.edge[static_cast<size_t>(edges[i])]);
  const auto& inside = rates.inside[static_cast<size_t>(face)];
  all.push_back(inside[0]);
  if (edges.size() == 4) all.push_back(inside[1]);
  return Tessellation(parameters, static_cast<int>(all.size()), all.data(),
                      Tessellation::Options().SetFacetSize(4).PreserveQuads(true));
}

/// Where the parts of the faces begin in the result, behind the cage's points.
struct Layout {
  std::vector<uint64_t> edge_vertex;    ///< per edge: its first vertex
  std::vector<uint64_t> face_vertex;    ///< per face: its first vertex inside
  std::vector<uint64_t> facet, corner;  ///< per face
  uint64_t vertex_count = 0, facet_count = 0, corner_count = 0;
};

/// Replaces each number by the sum of those before it, begun with `first`; returns the sum of all.
uint64_t to_begins(std::vector<uint64_t>& counts, uint64_t first) {
  for (uint64_t& count : counts) first += std::exchange(count, first);
  return first;
}

Layout lay_out(const LimitSurface& surface, const TessellationRates& rates) {
  const auto topology = surface.topology();
  const size_t faces = rates.inside.size();
  Layout layout;
  for (const int rate : rates.edge) layout.edge_vertex.push_back(static_cast<uint64_t>(rate) - 1);
  layout.face_vertex.assign(faces, 0);
  layout.facet.assign(faces, 0);
  layout.corner.assign(faces, 0);
  parallel_for(faces, kGrain, [&](size_t begin, size_t end) {
    std::vector<int> facets;
    for (size_t face = begin; face < end; ++face) {
      if (topology.IsFaceHole(static_cast<int>(face))) continue;
      const Tessellation pattern = pattern_of(surface, rates, static_cast<int>(face));
      layout.face_vertex[face] = static_cast<uint64_t>(pattern.GetNumInteriorCoords());
      layout.facet[face] = static_cast<uint64_t>(pattern.GetNumFacets());
      facets.resize(4 * layout.facet[face]);
      pattern.GetFacets(facets.data());
      layout.corner[face] = static_cast<uint64_t>(std::ranges::count_if(facets, [](int i) { return i >= 0; }));
    }
  });
  layout.vertex_count = to_begins(layout.edge_vertex, static_cast<uint64_t>(topology.GetNumVertices()));
  layout.vertex_count = to_begins(layout.face_vertex, layout.vertex_count);
  layout.facet_count = to_begins(layout.facet, 0);
  layout.corner_count = to_begins(layout.corner, 0);
  return layout;
}

/// Writes the faces of the result, each into its own place.
class Tessellator {
 public:
  Tessellator(const LimitSurface& surface, const TessellationRates& rates, const Layout& layout,
              const std::vector<uint32_t>& cage_material, SourceMesh& out)
      : surface_(surface), rates_(rates), layout_(layout), cage_material_(cage_material), out_(out) {
    out_.positions = surface.cage().points;  // those of holes alone stay; no face has them
    out_.positions.resize(layout.vertex_count);
    out_.corner_position.resize(layout.corner_count);
    out_.corner_normal.resize(layout.corner_count);
    if (has_uv()) out_.corner_uv.resize(layout.corner_count);
    if (has_color()) out_.corner_color.resize(layout.corner_count);
    out_.face_begin.resize(layout.facet_count + 1);
    out_.face_material.resize(layout.facet_count);
    out_.face_number.resize(layout.facet_count);
  }

  /// How many faces have no surface although they are no holes.
  size_t run(const Job& job) {
    std::atomic<size_t> lost{0};  // counted only: the order does not matter
    parallel_for(rates_.inside.size(), kGrain, [&](size_t begin, size_t end) {
      FaceLimit limit(surface_);
      for (size_t face = begin; face < end && !job.is_cancelled(); ++face) {
        if (surface_.topology().IsFaceHole(static_cast<int>(face))) continue;
        if (limit.move_to(static_cast<int>(face))) {
          add_face(static_cast<int>(face), limit);
        } else {
          ++lost;
        }
      }
    });
    return lost;
  }

 private:
  bool has_uv() const { return !surface_.cage().uv.corner_value.empty(); }
  bool has_color() const { return !surface_.cage().color.corner_value.empty(); }

  void add_face(int face, const FaceLimit& limit) {
    const Tessellation pattern = pattern_of(surface_, rates_, face);
    std::vector<dvec2> at(static_cast<size_t>(pattern.GetNumCoords()));
    pattern.GetCoords(&at[0].x);
    std::vector<bool> is_own(at.size(), true);
    const std::vector<uint32_t> vertex = vertices_of(face, pattern, is_own);
    std::vector<vec3> normal;
    std::vector<vec2> uv;
    std::vector<vec4> color;
    for (size_t i = 0; i < at.size(); ++i) {
      const LimitPoint point = limit.point(at[i]);
      if (is_own[i]) out_.positions[vertex[i]] = point.position;
      normal.emplace_back(point.normal);
      if (has_uv()) uv.emplace_back(limit.uv(at[i]));
      if (has_color()) color.emplace_back(limit.color(at[i]));
    }

    std::vector<int> facets(4 * static_cast<size_t>(pattern.GetNumFacets()));
    pattern.GetFacets(facets.data());
    uint64_t corner = layout_.corner[static_cast<size_t>(face)], facet = layout_.facet[static_cast<size_t>(face)];
    for (size_t i = 0; i < facets.size(); ++i) {
      if (i % 4 == 0) begin_facet(face, facet++, corner);
      if (facets[i] < 0) continue;  // of a triangle the fourth
      const auto number = static_cast<size_t>(facets[i]);
      out_.corner_position[corner] = vertex[number];
      out_.corner_normal[corner] = normal[number];
      if (has_uv()) out_.corner_uv[corner] = uv[number];
      if (has_color()) out_.corner_color[corner] = color[number];
      ++corner;
    }
  }

  void begin_facet(int face, uint64_t facet, uint64_t corner) {
    const uint32_t number = surface_.cage().face[static_cast<size_t>(face)];
    out_.face_begin[facet] = static_cast<uint32_t>(corner);
    out_.face_material[facet] = cage_material_[number];
    out_.face_number[facet] = number;
  }

  /// The vertices of the pattern's coordinates: around the face from its first point on, then those inside.
  std::vector<uint32_t> vertices_of(int face, const Tessellation& pattern, std::vector<bool>& is_own) const {
    const auto topology = surface_.topology();
    const auto points = topology.GetFaceVertices(face), edges = topology.GetFaceEdges(face);
    std::vector<uint32_t> vertex;
    const auto add = [&](uint64_t number, bool own) {
      is_own[vertex.size()] = own;
      vertex.push_back(static_cast<uint32_t>(number));
    };
    for (int i = 0; i < points.size(); ++i) {
      add(static_cast<uint64_t>(points[i]), surface_.owns_point(face, points[i]));
      const auto edge = static_cast<size_t>(edges[i]);
      const bool own = surface_.owns_edge(face, edges[i]);
      const bool is_forward = topology.GetEdgeVertices(edges[i])[0] == points[i];
      const auto count = static_cast<uint64_t>(rates_.edge[edge]) - 1;
      for (uint64_t k = 0; k < count; ++k) add(layout_.edge_vertex[edge] + (is_forward ? k : count - 1 - k), own);
    }
    const uint64_t first = layout_.face_vertex[static_cast<size_t>(face)];
    for (uint64_t k = 0; k < static_cast<uint64_t>(pattern.GetNumInteriorCoords()); ++k) add(first + k, true);
    return vertex;
  }

  const LimitSurface& surface_;
  const TessellationRates& rates_;
  const Layout& layout_;
  const std::vector<uint32_t>& cage_material_;
  SourceMesh& out_;
};

struct Plan {
  TessellationRates rates;
  Layout layout;
};

/// About as many as there will be faces: enough to know of far too many before they are laid out.
uint64_t cells_inside(const TessellationRates& rates) {
  uint64_t count = 0;
  for (const auto& [u, v] : rates.inside) count += static_cast<uint64_t>(u) * static_cast<uint64_t>(v);
  return count;
}

/// Rates that keep within the limits or, where that would be too many faces, as near as may be: said once.
Result<Plan> plan_faces(const LimitSurface& surface, TessellationLimits limits, const SubdivisionOptions& options,
                        const std::string& name, std::vector<std::string>& warnings, const Job& job) {
  const double asked = limits.error;
  while (true) {
    Plan plan;
    plan.rates = find_rates(surface, limits, job);
    if (job.is_cancelled()) return cancelled();
    const auto most = std::min<uint64_t>(options.most_faces, UINT32_MAX / 4);  // corners have 32-bit numbers
    uint64_t count = cells_inside(plan.rates);
    if (count <= most) {
      plan.layout = lay_out(surface, plan.rates);
      count = plan.layout.facet_count;
    }
    if (count <= most) {
      if (limits.error > asked) {
        warnings.push_back(fmt::format(
            "the cage's surface would take more than {} faces; they lie within {:.3g} voxels of it, not {:.3g}", most,
            options.error * limits.error / asked, options.error));
      }
      return plan;
    }
    const bool is_coarsest = std::ranges::all_of(plan.rates.edge, [](int rate) { return rate == 1; }) &&
                             std::ranges::all_of(plan.rates.inside, [](auto r) { return r[0] == 1 && r[1] == 1; });
    if (is_coarsest) {
      return make_error(ErrorCode::Unsupported, fmt::format("{}: a cage of {} faces, where {} are the most of its "
                                                            "surface; bake it in parts, or as it is",
                                                            name, surface.cage().face_size.size(), most));
    }
    // Faces become fewer as the error grows, and with the square of edges.
    const double growth = 1.1 * static_cast<double>(count) / static_cast<double>(most);
    limits.error *= growth;
    limits.edge *= std::sqrt(growth);
  }
}

/// What the caller says, else what the file says, else what USD takes for granted.
LimitRules rules_of(const SubdivisionOptions& options, const CageTags& tags) {
  LimitRules rules;
  rules.scheme = options.scheme;
  rules.boundary = options.boundary.value_or(tags.boundary.value_or(rules.boundary));
  rules.uv = options.uv.value_or(tags.uv.value_or(rules.uv));
  rules.creasing = tags.creasing;
  return rules;
}

Result<void> check_faces(const Cage& cage, SubdivisionScheme scheme, const std::string& name,
                         std::vector<std::string>& warnings) {
  const auto triangles = static_cast<size_t>(std::ranges::count(cage.face_size, 3));
  const size_t others = cage.face_size.size() - triangles;
  if (scheme == SubdivisionScheme::Loop && others > 0) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("{}: {} of {} faces are no triangles, which Loop's scheme needs; subdivide it by "
                                  "catmull-clark",
                                  name, others, cage.face_size.size()));
  }
  if (scheme == SubdivisionScheme::CatmullClark && triangles > others) {
    warnings.push_back("the cage is mostly triangles, which ripple under catmull-clark; loop is made for them");
  }
  return {};
}

bool are_all_quads(const Cage& cage) {
  return std::ranges::all_of(cage.face_size, [](int size) { return size == 4; });
}

Result<SourceMesh> subdivide_mesh(SourceMesh& mesh, const SubdivisionOptions& options, const std::string& name,
                                  const Job& job) {
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY_LET(Cage given, make_cage(mesh, name, job));
  FARFIELD_TRY(check_faces(given, options.scheme, name, mesh.warnings));
  const LimitRules rules = rules_of(options, mesh.cage);
  const bool is_fit = options.scheme == SubdivisionScheme::Loop || are_all_quads(given);
  const Cage cage = is_fit ? std::move(given) : refine_to_quads(given, rules);
  const LimitSurface surface(cage, rules);
  const double voxel = cage.side / std::max(options.grid, 1u);
  FARFIELD_TRY_LET(const Plan plan, plan_faces(surface, {options.error * voxel, options.edge * voxel}, options, name,
                                               mesh.warnings, job));
  SourceMesh out;
  const size_t lost = Tessellator(surface, plan.rates, plan.layout, mesh.face_material, out).run(job);
  if (job.is_cancelled()) return cancelled();
  if (lost > 0) {  // not known to happen
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: {} faces of the cage have no limit surface; bake it as it is", name, lost));
  }
  out.face_begin.back() = static_cast<uint32_t>(plan.layout.corner_count);
  out.materials = std::move(mesh.materials);
  out.material_function = std::move(mesh.material_function);
  out.material_batch = std::move(mesh.material_batch);
  out.warnings = std::move(mesh.warnings);
  out.source_files = std::move(mesh.source_files);
  out.source_hash = mesh.source_hash;
  return out;
}

}  // namespace

Result<SourceMesh> subdivide(SourceMesh mesh, const SubdivisionOptions& options, const std::string& name,
                             const Job& job) {
  if (options.scheme != SubdivisionScheme::None) {
    return with_warnings(subdivide_mesh(mesh, options, name, job), mesh.warnings);
  }
  if (!mesh.cage.empty()) {
    mesh.warnings.push_back(
        fmt::format("it is tagged as a subdivision cage ({} creases, {} corners, {} holes) and read "
                    "as flat polygons; --subdivide catmull-clark or loop makes it smooth",
                    mesh.cage.crease_edges.size(), mesh.cage.sharp_vertices.size(), mesh.cage.holes.size()));
  }
  return mesh;
}

}  // namespace farfield
