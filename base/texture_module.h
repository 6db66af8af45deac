// SPDX-License-Identifier: Apache-2.0
// The border to the module that reads, writes and looks up images. OpenImageIO brings 250 libraries, 130 MiB and a
// quarter of a second with it: they are for those who need an image, so the module is loaded by the first of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/surface_material.h"

namespace farfield {

/// An image as its file stores it: no colour space, no alpha applied.
struct DecodedImage {
  int width = 0, height = 0;
  int channels = 0;           ///< at most 4
  int alpha_channel = -1;     ///< -1 if there is none
  bool is_float = false;      ///< the file stores floats; integers are scaled to [0, 1]
  std::vector<float> values;  ///< width * height * channels, row by row from the top
};

/// One size of an image: rows from the top, channels interleaved, 65535 = 1.
struct MipLevel {
  int width = 0, height = 0;
  std::vector<uint16_t> values;
};

/// Where and how widely a texture is looked up: half-axes of nothing, the whole way across the footprint.
struct TextureFootprint {
  float u = 0, v = 0;  ///< v points down the image; finite
  float du_dx = 0, dv_dx = 0, du_dy = 0, dv_dy = 0;
};

/// Texture files behind a cache of their tiles. look_up() and bytes() are safe from any thread at any time, the rest is
/// for one thread while nobody looks up.
class TextureLookup {
 public:
  virtual ~TextureLookup() = default;
  /// The cache holds no more than this, but for what one tile per thread needs. At least kSmallestTextureCache.
  virtual void set_cache_bytes(uint64_t bytes) = 0;
  /// A handle for look_up(). The file is opened when it is needed.
  virtual uint32_t add(const std::string& path, Wrap wrap_u, Wrap wrap_v) = 0;
  /// The filtered value (trilinear, anisotropic up to 16) of the first `channels` channels. False: the file cannot be
  /// read; error() then says why.
  virtual bool look_up(uint32_t texture, const TextureFootprint& footprint, int channels, float* values) const = 0;
  virtual std::string error() const = 0;
  /// Forgets all tiles and closes all files.
  virtual void clear() = 0;
};

/// OpenImageIO's caches cannot be smaller.
inline constexpr uint64_t kSmallestTextureCache = uint64_t{10} << 20;

/// What the module exports, under the name kTextureModuleEntry. All from any thread. `name` is for messages. Errors of
/// reading: BadFile, Unsupported (too large, unknown format); of writing: Io.
struct TextureModule {
  Result<DecodedImage> (*read_file)(const std::string& path);
  Result<DecodedImage> (*decode)(std::span<const unsigned char> bytes, const std::string& name);
  /// Writes a tiled TIFF of 16-bit channels, or of 8-bit ones (values then multiples of 257, or rounded). The same
  /// levels give the same bytes.
  Result<void> (*write_mip_map)(const std::string& path, std::span<const MipLevel> levels, int channels, bool as_bytes);
  std::unique_ptr<TextureLookup> (*make_lookup)();
};

/// A change of the types above takes the next number: a module of another version is then refused, not misread.
inline constexpr const char* kTextureModuleEntry = "farfield_texture_module_2";

/// The module, loaded at the first call and never unloaded. Any thread. Errors: Io (it is missing or cannot be loaded;
/// later calls say the same).
Result<const TextureModule*> texture_module();

/// Loads the module from the first folder that has its file. Errors: Io.
Result<const TextureModule*> load_texture_module(std::span<const std::filesystem::path> folders);

}  // namespace farfield
