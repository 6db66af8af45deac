// SPDX-License-Identifier: Apache-2.0
#include "import/image_files.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/hash.h"
#include "import/read_file.h"

namespace farfield {

namespace fs = std::filesystem;

std::string with_slashes(std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '\\', '/');
  return text;
}

Result<std::vector<unsigned char>> ImageFiles::read_noted(const fs::path& path) {
  auto bytes = read_file(path);
  const fs::path relative = path.lexically_relative(folder_);
  mesh_.source_files.push_back(
      {(relative.empty() ? path : relative).generic_string(), bytes ? hash_values<unsigned char>(*bytes) : 0});
  return bytes;
}

namespace {

/// From the bytes that were just read, except of formats that only a file's name tells (TGA).
Result<Texture> to_texture(const Result<std::vector<unsigned char>>& bytes, const fs::path& path, TextureUse use) {
  if (bytes) {
    auto image = decode_texture(*bytes, path.string(), use);
    if (image || image.error().code != ErrorCode::Unsupported) return image;
  }
  return read_texture(path, use);
}

}  // namespace

std::shared_ptr<const Texture> ImageFiles::read(const fs::path& folder, std::string_view name, TextureUse use) {
  const fs::path named = folder / with_slashes(name);
  const auto [found, is_new] = images_.try_emplace({named.string(), use});
  if (!is_new) return found->second;
  fs::path path = named;
  auto bytes = read_noted(named);
  if (!bytes && fs::is_regular_file(folder / named.filename()) && folder / named.filename() != named) {
    path = folder / named.filename();
    bytes = read_noted(path);
    mesh_.warnings.push_back(fmt::format("texture {}: not there; {} is taken", named.string(), path.string()));
  }
  auto image = to_texture(bytes, path, use);
  if (image) return found->second = std::make_shared<const Texture>(std::move(*image));
  if (image.error().code == ErrorCode::Io) ready_ = tl::unexpected(image.error());
  mesh_.warnings.push_back(fmt::format("texture: {}; the plain colour is used", image.error().message));
  return nullptr;
}

}  // namespace farfield
