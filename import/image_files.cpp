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
template <typename Decode, typename Read>
auto to_image(const Result<std::vector<unsigned char>>& bytes, const Decode& decode, const Read& read) {
  if (bytes) {
    auto image = decode(*bytes);
    if (image || image.error().code != ErrorCode::Unsupported) return image;
  }
  return read();
}

}  // namespace

ImageFiles::Found ImageFiles::find(const fs::path& folder, const fs::path& named) {
  auto bytes = read_noted(named);
  const fs::path other = bytes ? fs::path() : find_by_last_name(folder, named);
  if (other.empty()) return {named, std::move(bytes)};
  mesh_.warnings.push_back(fmt::format("texture {}: not there; {} is taken", named.string(), other.string()));
  return {other, read_noted(other)};
}

void ImageFiles::miss(const Error& error, const char* instead) {
  if (error.code == ErrorCode::Io) {
    ready_ = tl::unexpected(error);
  } else {
    mesh_.warnings.push_back(fmt::format("texture: {}; {}", error.message, instead));
  }
}

std::shared_ptr<const Texture> ImageFiles::read(const fs::path& folder, std::string_view name, TextureUse use) {
  const fs::path named = folder / with_slashes(name);
  const auto [found, is_new] = images_.try_emplace({named.string(), use});
  if (!is_new) return found->second;
  const Found file = find(folder, named);
  auto image = to_image(
      file.bytes, [&](const auto& bytes) { return decode_texture(bytes, file.path.string(), use); },
      [&] { return read_texture(file.path, use); });
  if (image) return found->second = std::make_shared<const Texture>(std::move(*image));
  miss(image.error(), "the plain colour is used");
  return nullptr;
}

std::shared_ptr<const HeightMap> ImageFiles::read_heights(const fs::path& folder, std::string_view name, char channel) {
  const fs::path named = folder / with_slashes(name);
  const auto [found, is_new] = heights_.try_emplace({named.string(), channel});
  if (!is_new) return found->second;
  const Found file = find(folder, named);
  auto map = to_image(
      file.bytes, [&](const auto& bytes) { return decode_heights(bytes, file.path.string(), channel); },
      [&] { return farfield::read_heights(file.path, channel); });
  if (!map) {
    miss(map.error(), "the surface is not displaced");
    return nullptr;
  }
  if (const std::string mended = what_was_mended(*map, file.path.string()); !mended.empty()) {
    mesh_.warnings.push_back(mended);
  }
  return found->second = std::make_shared<const HeightMap>(std::move(*map));
}

}  // namespace farfield
