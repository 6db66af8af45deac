// SPDX-License-Identifier: Apache-2.0
#include "import/image_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>

#include "base/hash.h"
#include "base/text.h"
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

/// The file of a folder that has this name in upper or lower case; the first of several, so that it is the same one
/// everywhere. Empty if there is none.
fs::path in_other_letters(const fs::path& folder, const fs::path& name) {
  const std::string wanted = lower_case(name.string());
  std::set<fs::path> fitting;
  std::error_code error;
  fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const fs::path other = entry->path().filename();
    std::error_code unreadable;
    if (other != name && lower_case(other.string()) == wanted && entry->is_regular_file(unreadable)) {
      fitting.insert(other);
    }
  }
  return fitting.empty() ? fs::path() : folder / *fitting.begin();
}

}  // namespace

fs::path find_by_last_name(const fs::path& folder, const fs::path& named) {
  const fs::path exact = folder / named.filename();
  std::error_code too_long;  // or else
  if (exact != named && fs::is_regular_file(exact, too_long)) return exact;
  for (const fs::path& place : {named.parent_path(), folder}) {
    if (const fs::path found = in_other_letters(place, named.filename()); !found.empty()) return found;
  }
  return {};
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
  if (const fs::path other = bytes ? fs::path() : find_by_last_name(folder, named); !other.empty()) {
    path = other;
    bytes = read_noted(path);
    mesh_.warnings.push_back(fmt::format("texture {}: not there; {} is taken", named.string(), path.string()));
  }
  auto image = to_texture(bytes, path, use);
  if (image) return found->second = std::make_shared<const Texture>(std::move(*image));
  if (image.error().code == ErrorCode::Io) {
    ready_ = tl::unexpected(image.error());
    return nullptr;
  }
  mesh_.warnings.push_back(fmt::format("texture: {}; the plain colour is used", image.error().message));
  return nullptr;
}

}  // namespace farfield
