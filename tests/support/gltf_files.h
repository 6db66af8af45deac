// SPDX-License-Identifier: Apache-2.0
// Small glTF files for tests, written into a folder of their own.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace farfield {

/// A folder that is empty at the start and gone at the end.
class TempFolder {
 public:
  TempFolder() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            (std::string("farfield_") + test->test_suite_name() + "_" + test->name());
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() { std::filesystem::remove_all(path_); }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    // Truncating a file makes some file systems write it out at once: thousands of times that is slow.
    std::filesystem::remove(path_ / name);
    std::ofstream(path_ / name, std::ios::binary) << content;
    return path_ / name;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The bytes of numbers, as buffers hold them.
template <typename T>
std::string raw(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A .glb of a JSON text and a binary chunk.
inline std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto u32 = [](size_t v) { return raw<uint32_t>({static_cast<uint32_t>(v)}); };
  const size_t total = 12 + 8 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
  std::string out = "glTF" + u32(2) + u32(total) + u32(json.size()) + "JSON" + json;
  if (!binary.empty()) out += u32(binary.size()) + std::string("BIN\0", 4) + binary;
  return out;
}

}  // namespace farfield
