// SPDX-License-Identifier: Apache-2.0
#include "import/image_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <system_error>

#include "base/hash.h"
#include "import/read_file.h"

namespace farfield {

namespace fs = std::filesystem;

std::string with_slashes(std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '\\', '/');
  return text;
}

std::string lower_case(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

Result<std::vector<unsigned char>> ImageFiles::read_noted(const fs::path& path) {
  auto bytes = read_file(path);
  const fs::path relative = path.lexically_relative(folder_);
  mesh_.source_files.push_back(
      {(relative.empty() ? path : relative).generic_string(), bytes ? hash_values<unsigned char>(*bytes) : 0});
  return bytes;
}

fs::path find_by_last_name(const fs::path& folder, const fs::path& named) {
  const fs::path exact = folder / named.filename();
  if (exact != named && fs::is_regular_file(exact)) return exact;
  const std::string wanted = lower_case(named.filename().string());
  std::error_code error;
  for (const fs::path& place : {named.parent_path(), folder}) {
    std::set<fs::path> fitting;  // in order, so that the same one is taken everywhere
    for (const auto& entry : fs::directory_iterator(place, error)) {
      if (lower_case(entry.path().filename().string()) == wanted && entry.is_regular_file(error)) {
        fitting.insert(entry.path());
      }
    }
    if (!fitting.empty() && *fitting.begin() != named) return *fitting.begin();
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
  if (image.error().code == ErrorCode::Io) ready_ = tl::unexpected(image.error());
  mesh_.warnings.push_back(fmt::format("texture: {}; the plain colour is used", image.error().message));
  return nullptr;
}

}  // namespace farfield
