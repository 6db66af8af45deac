// SPDX-License-Identifier: Apache-2.0
#include "bake_api/gather_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>

#include "base/index.h"
#include "base/result.h"
#include "import/corner_normals.h"

namespace farfield {
namespace {

constexpr uint64_t kMostElements = kNoIndex;  // 32-bit indices, one of which means none

/// How messages call a mesh, and how they say what is wrong with it.
class MeshName {
 public:
  MeshName(const BakeMesh& mesh, size_t index)
      : text_(mesh.name.empty() ? fmt::format("mesh {}", index) : fmt::format("mesh {} ({})", index, mesh.name)) {}

  const std::string& text() const { return text_; }
  template <typename... Values>
  tl::unexpected<Error> error(fmt::format_string<Values...> format, Values&&... values) const {
    return make_error(ErrorCode::InvalidArgument, text_ + ": " + fmt::format(format, std::forward<Values>(values)...));
  }

 private:
  std::string text_;
};

/// The whole number in a row, if it is one in [0, limit).
std::optional<uint32_t> whole_number(const BakeRows<1>& rows, size_t row, uint64_t limit) {
  const double value = rows.at(row);
  if (!(value >= 0) || value >= static_cast<double>(limit) || value != std::floor(value)) return std::nullopt;
  return static_cast<uint32_t>(value);
}

/// The first row that has a number that is not finite in the type in which it will be kept. Nothing after a cancel.
template <typename Kept, int N>
std::optional<size_t> find_not_finite(const BakeRows<N>& rows, const Job& job) {
  for (size_t row = 0; row < rows.size() && !job.is_cancelled(); ++row) {
    for (int column = 0; column < N; ++column) {
      if (!std::isfinite(static_cast<Kept>(rows.at(row, column)))) return row;
    }
  }
  return std::nullopt;
}

// ---- checks; what a cancelled one says is of no use

size_t face_count(const BakeMesh& mesh) { return mesh.counts.empty() ? mesh.corners.size() / 3 : mesh.counts.size(); }

Result<void> check_counts(const BakeMesh& mesh, const MeshName& name, const Job& job) {
  const size_t corners = mesh.corners.size();
  if (mesh.counts.empty()) {
    if (corners % 3 == 0) return {};
    return name.error("{} corners are no whole triangles; give the corners of each face as counts", corners);
  }
  uint64_t sum = 0;
  for (size_t face = 0; face < mesh.counts.size() && !job.is_cancelled(); ++face) {
    const auto count = whole_number(mesh.counts, face, kMostElements);
    if (!count || *count < 3) return name.error("face {} has {} corners; 3 are the fewest", face, mesh.counts.at(face));
    sum += *count;
  }
  if (sum == corners) return {};
  return name.error("the counts of {} faces add up to {}, but there are {} corners", mesh.counts.size(), sum, corners);
}

Result<void> check_corners(const BakeMesh& mesh, const MeshName& name, const Job& job) {
  for (size_t i = 0; i < mesh.corners.size() && !job.is_cancelled(); ++i) {
    if (whole_number(mesh.corners, i, std::min<uint64_t>(mesh.points.size(), kMostElements))) continue;
    return name.error("corner {} has point {}; there are points 0 to {}", i, mesh.corners.at(i),
                      static_cast<int64_t>(mesh.points.size()) - 1);
  }
  return {};
}

Result<void> check_materials(const BakeMesh& mesh, const MeshName& name, const BakeInput& input, const Job& job) {
  const size_t faces = face_count(mesh);
  if (!mesh.materials.empty() && mesh.materials.size() != faces) {
    return name.error("{} material ids for {} faces; one for each, or none", mesh.materials.size(), faces);
  }
  // Faces of a mesh without ids have id 0.
  const bool is_complete = !has_material_function(input) && !input.materials.empty();
  const uint64_t limit = is_complete ? input.materials.size() : kMaxMaterials;
  for (size_t face = 0; face < mesh.materials.size() && !job.is_cancelled(); ++face) {
    if (whole_number(mesh.materials, face, limit)) continue;
    return name.error("face {} has material {}; there are materials 0 to {}", face, mesh.materials.at(face), limit - 1);
  }
  return {};
}

template <int N>
Result<void> check_attribute(const BakeAttribute<N>& attribute, const BakeMesh& mesh, const MeshName& name,
                             const char* what, const Job& job) {
  if (attribute.values.empty()) return {};
  const bool is_per_point = attribute.per == BakePer::Point;
  const size_t wanted = is_per_point ? mesh.points.size() : mesh.corners.size();
  if (attribute.values.size() != wanted) {
    return name.error("{} {} for {} {}; one for each, or none", attribute.values.size(), what, wanted,
                      is_per_point ? "points" : "corners");
  }
  if (const auto row = find_not_finite<float>(attribute.values, job)) {
    return name.error("{} {} are not finite", what, *row);
  }
  return {};
}

/// Sharpness may be infinite.
Result<void> check_sharpness(const BakeRows<1>& sharpness, size_t wanted, const MeshName& name, const char* what) {
  if (sharpness.size() != wanted) {
    return name.error("{} values of sharpness for {} {}; one for each", sharpness.size(), wanted, what);
  }
  for (size_t i = 0; i < wanted; ++i) {
    if (!(sharpness.at(i) >= 0)) return name.error("sharpness {} of its {} is {}", i, what, sharpness.at(i));
  }
  return {};
}

uint64_t edge_key(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

/// Corners and counts are checked already.
std::unordered_set<uint64_t> edges_of(const BakeMesh& mesh, const Job& job) {
  std::unordered_set<uint64_t> edges;
  const auto point = [&](size_t corner) { return static_cast<uint32_t>(mesh.corners.at(corner)); };
  size_t begin = 0;
  for (size_t face = 0; face < face_count(mesh) && !job.is_cancelled(); ++face) {
    const size_t count = mesh.counts.empty() ? 3 : static_cast<size_t>(mesh.counts.at(face));
    for (size_t i = 0; i < count; ++i) edges.insert(edge_key(point(begin + i), point(begin + (i + 1) % count)));
    begin += count;
  }
  return edges;
}

Result<void> check_creases(const BakeMesh& mesh, const MeshName& name, const Job& job) {
  FARFIELD_TRY(check_sharpness(mesh.crease_sharpness, mesh.creases.size(), name, "creases"));
  FARFIELD_TRY(check_sharpness(mesh.point_sharpness, mesh.sharp_points.size(), name, "sharp points"));
  for (size_t i = 0; i < mesh.sharp_points.size() && !job.is_cancelled(); ++i) {
    if (whole_number(mesh.sharp_points, i, mesh.points.size())) continue;
    return name.error("sharp point {} is {}; there are points 0 to {}", i, mesh.sharp_points.at(i),
                      static_cast<int64_t>(mesh.points.size()) - 1);
  }
  if (mesh.creases.empty()) return {};
  const std::unordered_set<uint64_t> edges = edges_of(mesh, job);
  for (size_t i = 0; i < mesh.creases.size() && !job.is_cancelled(); ++i) {
    const double a = mesh.creases.at(i, 0), b = mesh.creases.at(i, 1);
    const auto is_point = [](double p) {
      return p >= 0 && p < static_cast<double>(kMostElements) && p == std::floor(p);
    };
    if (is_point(a) && is_point(b) && edges.contains(edge_key(static_cast<uint32_t>(a), static_cast<uint32_t>(b)))) {
      continue;
    }
    return name.error("crease {} lies between points {} and {}, which no face joins by an edge", i, a, b);
  }
  return {};
}

Result<void> check_mesh(const BakeMesh& mesh, const MeshName& name, const BakeInput& input, const Job& job) {
  if (const auto point = find_not_finite<double>(mesh.points, job)) return name.error("point {} is not finite", *point);
  FARFIELD_TRY(check_counts(mesh, name, job));
  FARFIELD_TRY(check_corners(mesh, name, job));
  FARFIELD_TRY(check_materials(mesh, name, input, job));
  FARFIELD_TRY(check_attribute(mesh.uv, mesh, name, "uv coordinates", job));
  FARFIELD_TRY(check_attribute(mesh.normals, mesh, name, "normals", job));
  FARFIELD_TRY(check_attribute(mesh.colors, mesh, name, "colors", job));
  if (mesh.scheme && *mesh.scheme > BakeSubdivision::Scheme::Loop) {
    return name.error("a subdivision scheme that does not exist");
  }
  return check_creases(mesh, name, job);
}

Result<void> check_instance(const BakeInstance& instance, size_t index, size_t mesh_count) {
  const auto error = [&](const std::string& what) {
    return make_error(ErrorCode::InvalidArgument, fmt::format("instance {}: {}", index, what));
  };
  if (instance.mesh >= mesh_count) return error(fmt::format("mesh {} of {}", instance.mesh, mesh_count));
  for (int column = 0; column < 4; ++column) {
    const dvec3& c = instance.to_asset[column];
    if (!std::isfinite(c.x) || !std::isfinite(c.y) || !std::isfinite(c.z)) return error("its transform is not finite");
  }
  const double determinant = glm::determinant(glm::dmat3(instance.to_asset));
  if (determinant == 0 || !std::isfinite(determinant)) return error("its transform cannot be inverted");
  return {};
}

// ---- copies

/// What the meshes have between them: an attribute that one lacks is filled up for it.
struct Attributes {
  bool uv = false, normals = false, colors = false;
  bool scheme = false;  ///< of its own
  bool scale = false;   ///< by an instance
};

Attributes attributes_of(const std::vector<BakeMesh>& meshes) {
  Attributes has;
  for (const BakeMesh& mesh : meshes) {
    has.uv |= !mesh.uv.values.empty();
    has.normals |= !mesh.normals.values.empty();
    has.colors |= !mesh.colors.values.empty();
    has.scheme |= mesh.scheme.has_value();
  }
  return has;
}

template <int N>
glm::vec<N, float> row_of(const BakeRows<N>& rows, size_t row) {
  glm::vec<N, float> out;
  for (int column = 0; column < N; ++column) out[column] = static_cast<float>(rows.at(row, column));
  return out;
}

/// The attribute at corner `corner`, which has the point `point`.
template <int N>
glm::vec<N, float> value_at(const BakeAttribute<N>& attribute, size_t corner, size_t point,
                            const glm::vec<N, float>& missing) {
  if (attribute.values.empty()) return missing;
  return row_of(attribute.values, attribute.per == BakePer::Point ? point : corner);
}

void append_creases(const BakeMesh& mesh, uint32_t first_position, CageTags& out) {
  const auto point = [&](double number) { return first_position + static_cast<uint32_t>(number); };
  for (size_t i = 0; i < mesh.creases.size(); ++i) {
    out.crease_edges.emplace_back(point(mesh.creases.at(i, 0)), point(mesh.creases.at(i, 1)));
    out.crease_sharpness.push_back(static_cast<float>(std::min(mesh.crease_sharpness.at(i), 1e30)));
  }
  for (size_t i = 0; i < mesh.sharp_points.size(); ++i) {
    out.sharp_vertices.push_back(point(mesh.sharp_points.at(i)));
    out.vertex_sharpness.push_back(static_cast<float>(std::min(mesh.point_sharpness.at(i), 1e30)));
  }
}

/// By which heights of displacement grow with an instance.
double scale_of(const glm::dmat4x3& to_asset) { return std::cbrt(std::abs(glm::determinant(glm::dmat3(to_asset)))); }

std::optional<SubdivisionScheme> scheme_of(const BakeMesh& mesh) {
  if (!mesh.scheme) return std::nullopt;
  return static_cast<SubdivisionScheme>(*mesh.scheme);  // the same order, which bake_api.cpp asserts
}

/// Appends one instance of a checked mesh; a part of it after a cancel.
void append(const BakeMesh& mesh, const glm::dmat4x3& to_asset, const Attributes& has, const Job& job,
            SourceMesh& out) {
  const auto first_position = static_cast<uint32_t>(out.positions.size());
  for (size_t i = 0; i < mesh.points.size() && !job.is_cancelled(); ++i) {
    out.positions.push_back(to_asset * glm::dvec4(mesh.points.at(i, 0), mesh.points.at(i, 1), mesh.points.at(i, 2), 1));
  }
  append_creases(mesh, first_position, out.cage);
  const glm::dmat3 linear(to_asset);
  const glm::dmat3 of_normals = glm::transpose(glm::inverse(linear));
  // A mirror image winds the other way; turned round, its faces agree with its normals again.
  const bool is_mirrored = glm::determinant(linear) < 0;
  const double scale = scale_of(to_asset);
  size_t begin = 0;
  for (size_t face = 0; face < face_count(mesh) && !job.is_cancelled(); ++face) {
    const size_t count = mesh.counts.empty() ? 3 : static_cast<size_t>(mesh.counts.at(face));
    for (size_t i = 0; i < count; ++i) {
      const size_t corner = is_mirrored ? begin + count - 1 - i : begin + i;
      const auto point = static_cast<uint32_t>(mesh.corners.at(corner));
      out.corner_position.push_back(first_position + point);
      if (has.uv) {
        out.corner_uv.push_back(value_at(mesh.uv, corner, point, vec2(std::numeric_limits<float>::quiet_NaN())));
      }
      if (has.normals) {
        out.corner_normal.push_back(unit_normal(of_normals * dvec3(value_at(mesh.normals, corner, point, vec3(0.0f)))));
      }
      if (has.colors) out.corner_color.push_back(value_at(mesh.colors, corner, point, vec4(1.0f)));
    }
    begin += count;
    out.face_begin.push_back(static_cast<uint32_t>(out.corner_position.size()));
    out.face_material.push_back(mesh.materials.empty() ? 0 : static_cast<uint32_t>(mesh.materials.at(face)));
    if (has.scheme) out.face_scheme.push_back(scheme_of(mesh));
    if (has.scale) out.face_height_scale.push_back(static_cast<float>(scale));
  }
}

std::vector<BakeInstance> each_mesh_once(size_t mesh_count) {
  std::vector<BakeInstance> instances(mesh_count);
  for (size_t i = 0; i < mesh_count; ++i) instances[i].mesh = static_cast<uint32_t>(i);
  return instances;
}

tl::unexpected<Error> cancelled() { return make_error(ErrorCode::Cancelled, "bake: cancelled"); }

Result<void> check_meshes(const BakeInput& input, const Job& job, std::vector<std::string>& warnings) {
  for (size_t i = 0; i < input.meshes.size(); ++i) {
    const MeshName name(input.meshes[i], i);
    const auto checked = check_mesh(input.meshes[i], name, input, job);
    if (job.is_cancelled()) return cancelled();
    FARFIELD_TRY(checked);
    if (face_count(input.meshes[i]) == 0) warnings.push_back(name.text() + ": has no faces");
  }
  return {};
}

Result<void> append_all(const BakeInput& input, const Job& job, SourceMesh& out) {
  const auto instances = input.instances.empty() ? each_mesh_once(input.meshes.size()) : input.instances;
  uint64_t points = 0, corners = 0;
  for (size_t i = 0; i < instances.size(); ++i) {
    FARFIELD_TRY(check_instance(instances[i], i, input.meshes.size()));
    points += input.meshes[instances[i].mesh].points.size();
    corners += input.meshes[instances[i].mesh].corners.size();
  }
  if (corners == 0) return make_error(ErrorCode::InvalidArgument, "bake: there is no face in any mesh that is shown");
  if (points >= kMostElements || corners >= kMostElements) {
    return make_error(ErrorCode::Unsupported,
                      fmt::format("bake: {} points and {} corners, with all instances, are more than one asset holds; "
                                  "bake parts of it",
                                  points, corners));
  }
  out.positions.reserve(points);
  out.corner_position.reserve(corners);
  Attributes has = attributes_of(input.meshes);
  has.scale =
      std::ranges::any_of(instances, [](const BakeInstance& instance) { return scale_of(instance.to_asset) != 1; });
  for (const BakeInstance& instance : instances) {
    const size_t first_face = out.face_count();
    append(input.meshes[instance.mesh], instance.to_asset, has, job, out);
    if (job.is_cancelled()) return cancelled();
    out.placements.push_back({instance.mesh, first_face, out.face_count() - first_face, instance.to_asset});
  }
  return {};
}

}  // namespace

Result<SourceMesh> gather_mesh(const BakeInput& input, const Job& job) {
  SourceMesh out;
  FARFIELD_TRY(with_warnings(check_meshes(input, job, out.warnings), out.warnings));
  FARFIELD_TRY(with_warnings(append_all(input, job, out), out.warnings));
  return out;
}

}  // namespace farfield
