// SPDX-License-Identifier: Apache-2.0
// The materials that an OBJ uses, from the MTL files that it names before or after it uses them.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/index.h"
#include "import/image_files.h"
#include "import/read_mtl.h"

namespace farfield {

/// One thread at a time. docs/decisions/0006 has the rules by which an MTL material becomes a SourceMaterial.
class MaterialLibraries {
 public:
  MaterialLibraries(std::filesystem::path folder, SourceMesh& mesh)
      : folder_(folder), mesh_(mesh), images_(std::move(folder), mesh) {}

  /// The rest of an mtllib line: one name with blanks, or several names.
  void load(std::string_view names);

  /// Index of a material by name; what it is, finish() says.
  uint32_t find(std::string_view name);

  /// The material of faces without one.
  uint32_t default_material() { return find(""); }

  /// All libraries are read: materials that were found get their content, unknown names are the default material, with
  /// one warning each. Errors: Io, when images cannot be read at all.
  Result<void> finish();

  /// Whether a library gave this material its content; after finish().
  bool is_defined(uint32_t material) const { return defined_.contains(material); }

  /// -s and -o of the textures of a material, for coordinates whose v points up.
  struct UvTransform {
    vec2 scale{1.0f}, offset{0.0f};
  };
  const UvTransform& uv_transform(uint32_t material) const { return uv_[material]; }

 private:
  struct Entry {
    MtlMaterial mtl;
    std::filesystem::path file;
    bool is_from_blender;
  };

  void warn(std::string text) { mesh_.warnings.push_back(std::move(text)); }
  bool load_file(const std::filesystem::path& path);
  bool zero_means_opaque() const;
  void set(uint32_t material, const Entry& entry);
  SourceMaterial convert(const Entry& entry, UvTransform& uv);
  void set_alpha(const Entry& entry, SourceMaterial& out);
  void set_color(const Entry& entry, SourceMaterial& out);
  void set_metallic_roughness_map(const Entry& entry, SourceMaterial& out);
  void set_emission(const Entry& entry, SourceMaterial& out);
  void set_normals(const Entry& entry, SourceMaterial& out);
  SourceHeights heights(const Entry& entry);
  SourceTexture mask(const Entry& entry, const MtlMap& map);
  SourceTexture texture(const Entry& entry, const MtlMap& map, TextureUse use);
  void keep_what_would_vanish();

  std::filesystem::path folder_;
  SourceMesh& mesh_;
  ImageFiles images_;
  std::vector<Entry> entries_;
  std::set<std::string> files_;  ///< that were read
  std::map<std::string, uint32_t, std::less<>> by_name_;
  std::set<uint32_t> defined_;
  std::vector<UvTransform> uv_;  ///< per material of the mesh
};

}  // namespace farfield
