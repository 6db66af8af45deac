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
#include "prefilter/displace.h"
#include "prefilter/face_heights.h"
#include "prefilter/limit_surface.h"
#include "prefilter/scheme_parts.h"
#include "prefilter/tessellation_rates.h"
#include "prefilter/triangulate.h"

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
  const osd::Bfr::Parameterization parameters = surface.parameterization(edges.size());
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
  /// heights: empty, or what is to be displaced; `detail` as detail_of() has it.
  Tessellator(const LimitSurface& surface, const FaceHeights& heights, double detail, const TessellationRates& rates,
              const Layout& layout, const std::vector<uint32_t>& cage_material, SourceMesh& out)
      : surface_(surface),
        heights_(heights),
        detail_(detail),
        rates_(rates),
        layout_(layout),
        cage_material_(cage_material),
        out_(out) {
    if (!heights.empty()) corner_height_.resize(layout.corner_count, 0.0f);
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

  /// One per corner of the result; empty if nothing is displaced.
  const std::vector<float>& corner_height() const { return corner_height_; }

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
    std::vector<float> height;
    const SourceHeights* heights = heights_.of(face);
    const double scale = heights_.scale(face);
    const float footprint = heights ? detail_of(*heights, limit, detail_).footprint : 1.0f;
    for (size_t i = 0; i < at.size(); ++i) {
      const LimitPoint point = limit.point(at[i]);
      if (is_own[i]) out_.positions[vertex[i]] = point.position;
      normal.emplace_back(point.normal);
      if (has_uv()) uv.emplace_back(limit.uv(at[i]));
      if (has_color()) color.emplace_back(limit.color(at[i]));
      if (heights) height.push_back(static_cast<float>(scale * height_at(*heights, limit.uv(at[i]), footprint)));
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
      if (heights) corner_height_[corner] = height[number];
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
  const FaceHeights& heights_;
  double detail_;
  const TessellationRates& rates_;
  const Layout& layout_;
  const std::vector<uint32_t>& cage_material_;
  SourceMesh& out_;
  std::vector<float> corner_height_;
};

struct Plan {
  double detail = 0;
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
Result<Plan> plan_faces(const LimitSurface& surface, const FaceHeights& heights, TessellationLimits limits,
                        const SubdivisionOptions& options, const std::string& name, std::vector<std::string>& warnings,
                        const Job& job) {
  const double asked = limits.error, asked_detail = limits.detail;
  while (true) {
    Plan plan;
    plan.detail = limits.detail;
    plan.rates = find_rates(surface, heights, limits, job);
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
            "the {} surface would take more than {} faces; they lie within {:.3g} voxels of it, not {:.3g}{}",
            heights.empty() ? "cage's" : "displaced", most, options.error * limits.error / asked, options.error,
            heights.empty() ? ""
                            : fmt::format(", and heights are means over {:.3g} voxels, not {:.3g}; a smaller "
                                          "finest grid or larger --displace-detail says so on purpose",
                                          options.detail * limits.detail / asked_detail, options.detail)));
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
    limits.detail *= std::sqrt(growth);
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

bool has_uv(const SourceMesh& mesh, uint32_t face) {
  if (mesh.corner_uv.empty()) return false;
  return std::all_of(mesh.corner_uv.begin() + mesh.face_begin[face], mesh.corner_uv.begin() + mesh.face_begin[face + 1],
                     [](const vec2& uv) { return std::isfinite(uv.x) && std::isfinite(uv.y); });
}

double longest_side(const SourceMesh& mesh) {
  dvec3 lower(INFINITY), upper(-INFINITY);
  for (const uint32_t v : mesh.corner_position) {
    lower = glm::min(lower, mesh.positions[v]);
    upper = glm::max(upper, mesh.positions[v]);
  }
  const dvec3 size = upper - lower;
  return std::max(size.x, std::max(size.y, size.z));
}

/// Maps that are given in another unit than the mesh: an error where nothing of it would be left, said where it is odd.
Result<void> check_heights(const SourceHeights& heights, const std::string& material, double side,
                           const std::string& name, std::vector<std::string>& warnings) {
  constexpr double kAbsurd = 10, kOdd = 0.1;  // in sides: displacement is for small detail (thesis 6.1.5)
  const double a = double{heights.base} + double{heights.gain} * heights.map->least();
  const double b = double{heights.base} + double{heights.gain} * heights.map->most();
  const std::string says =
      fmt::format("material {}: displaced by {} to {:.4g} .. {:.4g}, where the mesh is {:.4g} across", material,
                  heights.name, std::min(a, b), std::max(a, b), side);
  const double highest = std::max(std::abs(a), std::abs(b));
  if (!(highest <= kAbsurd * side)) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}; scale it (-bm or -mm of disp, height_gain), or bake "
                                                      "with --no-displacement",
                                                      name, says));
  }
  if (highest > kOdd * side) warnings.push_back(says);
  return {};
}

/// Takes away the maps that displace nothing. Says what is not displaced although it has one.
Result<void> keep_heights_that_count(SourceMesh& mesh, bool is_wanted, const std::string& name) {
  if (!is_wanted) mesh.heights.clear();
  if (mesh.heights.empty()) return {};
  mesh.heights.resize(mesh.materials.size());
  std::vector<size_t> lacking(mesh.heights.size(), 0), displaced(mesh.heights.size(), 0);
  for (uint32_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t material = mesh.face_material[face];
    if (mesh.heights[material]) ++(has_uv(mesh, face) ? displaced : lacking)[material];
  }
  const double side = longest_side(mesh);
  bool is_any = false;
  for (size_t m = 0; m < mesh.heights.size(); ++m) {
    if (lacking[m] > 0) {
      mesh.warnings.push_back(fmt::format("material {}: {} faces have no texture coordinates for {}; not displaced",
                                          mesh.materials[m].name, lacking[m], mesh.heights[m].name));
    }
    if (displaced[m] == 0) continue;
    is_any = true;
    FARFIELD_TRY(check_heights(mesh.heights[m], mesh.materials[m].name, side, name, mesh.warnings));
  }
  if (!is_any) mesh.heights.clear();
  return {};
}

/// Whether the polygon is a quad that the parts of a bilinear patch fit into.
bool is_convex_quad(std::span<const dvec3> p) {
  if (p.size() != 4) return false;
  const dvec3 n = glm::cross(p[2] - p[0], p[3] - p[1]);
  for (size_t i = 0; i < 4; ++i) {
    if (!(glm::dot(n, glm::cross(p[(i + 1) % 4] - p[i], p[(i + 2) % 4] - p[(i + 1) % 4])) > 0)) return false;
  }
  return true;
}

/// Cuts what is neither triangle nor convex quad into triangles. face_number keeps what they were.
void cut_into_triangles_and_quads(SourceMesh& mesh) {
  SourceMesh out;
  std::vector<uint32_t> source_corner, source_face;
  std::vector<dvec3> points;
  for (uint32_t face = 0; face < mesh.face_count(); ++face) {
    const uint32_t begin = mesh.face_begin[face], count = mesh.face_begin[face + 1] - begin;
    points.clear();
    for (uint32_t i = 0; i < count; ++i) points.push_back(mesh.positions[mesh.corner_position[begin + i]]);
    const auto add = [&](std::span<const uint32_t> corners) {
      for (const uint32_t corner : corners) source_corner.push_back(begin + corner);
      out.face_begin.push_back(static_cast<uint32_t>(source_corner.size()));
      out.face_material.push_back(mesh.face_material[face]);
      source_face.push_back(face);
      out.face_number.push_back(mesh.face_number.empty() ? face : mesh.face_number[face]);
    };
    if (count == 3) {
      add(std::array{0u, 1u, 2u});
    } else if (is_convex_quad(points)) {
      add(std::array{0u, 1u, 2u, 3u});
    } else {
      for (const uvec3& t : triangulate_polygon(points)) add(std::array{t.x, t.y, t.z});
    }
  }
  const auto take = [&](auto& array) {
    if (array.empty()) return;
    auto all = std::exchange(array, {});
    for (const uint32_t corner : source_corner) array.push_back(all[corner]);
  };
  if (!mesh.face_height_scale.empty()) {
    auto all = std::exchange(mesh.face_height_scale, {});
    for (const uint32_t face : source_face) mesh.face_height_scale.push_back(all[face]);
  }
  take(mesh.corner_position);
  take(mesh.corner_uv);
  take(mesh.corner_color);
  take(mesh.corner_normal);
  mesh.face_begin = std::move(out.face_begin);
  mesh.face_material = std::move(out.face_material);
  mesh.face_number = std::move(out.face_number);
}

/// A cage that LimitSurface takes, by its rules.
Result<Cage> cage_for(SourceMesh& mesh, const LimitRules& rules, const std::string& name, const Job& job) {
  if (rules.scheme == SubdivisionScheme::None) {
    cut_into_triangles_and_quads(mesh);
    return make_cage(mesh, CageUse::AsItIs, name, job);
  }
  FARFIELD_TRY_LET(Cage given, make_cage(mesh, CageUse::Smoothed, name, job));
  FARFIELD_TRY(check_faces(given, rules.scheme, name, mesh.warnings));
  const bool is_fit = rules.scheme == SubdivisionScheme::Loop || are_all_quads(given);
  return is_fit ? std::move(given) : refine_to_quads(given, rules);
}

void keep_all_but_faces(SourceMesh& mesh, SourceMesh& out) {
  out.materials = std::move(mesh.materials);
  out.material_function = std::move(mesh.material_function);
  out.material_batch = std::move(mesh.material_batch);
  out.warnings.insert(out.warnings.begin(), mesh.warnings.begin(), mesh.warnings.end());
  out.source_files = std::move(mesh.source_files);
  out.source_hash = mesh.source_hash;
}

Result<SourceMesh> tessellate(SourceMesh& mesh, const SubdivisionOptions& options, double side, const std::string& name,
                              const Job& job) {
  const LimitRules rules = rules_of(options, mesh.cage);
  FARFIELD_TRY_LET(const Cage cage, cage_for(mesh, rules, name, job));
  const LimitSurface surface(cage, rules);
  const FaceHeights heights(cage, mesh);
  const double voxel = (side > 0 ? side : cage.side) / std::max(options.grid, 1u);
  const TessellationLimits limits{options.error * voxel, options.edge * voxel, options.detail * voxel};
  FARFIELD_TRY_LET(const Plan plan, plan_faces(surface, heights, limits, options, name, mesh.warnings, job));
  SourceMesh out;
  Tessellator tessellator(surface, heights, plan.detail, plan.rates, plan.layout, mesh.face_material, out);
  const size_t lost = tessellator.run(job);
  if (job.is_cancelled()) return cancelled();
  if (lost > 0) {  // not known to happen
    return make_error(ErrorCode::Unsupported,
                      fmt::format("{}: {} faces of the cage have no limit surface; bake it as it is", name, lost));
  }
  out.face_begin.back() = static_cast<uint32_t>(plan.layout.corner_count);
  if (!heights.empty()) displace(out, tessellator.corner_height());
  if (!mesh.face_number.empty()) {
    for (uint32_t& face : out.face_number) face = mesh.face_number[face];
  }
  keep_all_but_faces(mesh, out);
  return out;
}

/// Faces of one scheme. side: of all that the voxels are a part of; 0: the mesh's own.
Result<SourceMesh> subdivide_part(SourceMesh& mesh, const SubdivisionOptions& options, double side,
                                  const std::string& name, const Job& job) {
  const bool is_cage = options.scheme != SubdivisionScheme::None;
  if (!is_cage && !mesh.cage.empty()) {
    mesh.warnings.push_back(
        fmt::format("it is tagged as a subdivision cage ({} creases, {} corners, {} holes) and read "
                    "as flat polygons; --subdivide catmull-clark or loop makes it smooth",
                    mesh.cage.crease_edges.size(), mesh.cage.sharp_vertices.size(), mesh.cage.holes.size()));
  }
  if (!is_cage && mesh.heights.empty()) return std::move(mesh);
  return tessellate(mesh, options, side, name, job);
}

/// Faces of several schemes, each scheme's by itself.
Result<SourceMesh> subdivide_by_scheme(SourceMesh& mesh, SubdivisionOptions options, const std::string& name,
                                       const Job& job) {
  const SubdivisionScheme usual = options.scheme;
  const double side = longest_side(mesh);
  SourceMesh out;
  for (const auto scheme : {SubdivisionScheme::None, SubdivisionScheme::CatmullClark, SubdivisionScheme::Loop}) {
    SourceMesh part = take_scheme(mesh, scheme, usual);
    if (part.face_count() == 0) continue;
    options.scheme = scheme;
    FARFIELD_TRY_LET(const SourceMesh cut,
                     with_warnings(subdivide_part(part, options, side, name, job), part.warnings));
    if (out.corner_count() + cut.corner_count() > UINT32_MAX) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("{}: more than 2^32 corners of faces; bake it in parts", name));
    }
    append_part(cut, out);
  }
  keep_all_but_faces(mesh, out);
  return out;
}

Result<SourceMesh> subdivide_mesh(SourceMesh& mesh, SubdivisionOptions options, const std::string& name,
                                  const Job& job) {
  FARFIELD_TRY(check_options(options));
  FARFIELD_TRY(keep_heights_that_count(mesh, options.displace, name));
  if (mesh.face_scheme.empty()) return subdivide_part(mesh, options, 0, name, job);
  const auto scheme_of = [&](const auto& scheme) { return scheme.value_or(options.scheme); };
  const SubdivisionScheme first = scheme_of(mesh.face_scheme[0]);
  const auto is_first = [&](const auto& scheme) { return scheme_of(scheme) == first; };
  if (!std::ranges::all_of(mesh.face_scheme, is_first)) return subdivide_by_scheme(mesh, options, name, job);
  options.scheme = first;
  return subdivide_part(mesh, options, 0, name, job);
}

}  // namespace

Result<SourceMesh> subdivide(SourceMesh mesh, const SubdivisionOptions& options, const std::string& name,
                             const Job& job) {
  return with_warnings(subdivide_mesh(mesh, options, name, job), mesh.warnings);
}

}  // namespace farfield
