// SPDX-License-Identifier: Apache-2.0
#include "cache/level_format.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "base/check.h"
#include "base/hash.h"
#include "cache/level_check.h"
#include "cache/level_file.h"

namespace farfield {

namespace {

using Bytes = std::span<const std::byte>;

constexpr uint64_t kHeaderBytes = sizeof(FileHeader);

/// Where a section's claim on the file ends.
uint64_t end_of(const SectionEntry& section) {
  const bool padded = section.id == static_cast<uint32_t>(SectionId::Positions);
  return section.offset + section.bytes + (padded ? kPositionsPadding : 0);
}

uint64_t head_bytes(uint64_t section_count) { return kHeaderBytes + section_count * sizeof(SectionEntry); }

uint64_t hash_head(FileHeader header, Bytes table) {
  header.head_hash = 0;
  return hash_bytes(table, hash_values(std::span<const FileHeader>(&header, 1)));
}

void copy_to(std::array<float, 3>& stored, const vec3& v) { stored = {v.x, v.y, v.z}; }
vec3 to_vec3(const std::array<float, 3>& stored) { return {stored[0], stored[1], stored[2]}; }

/// The first version that has what a level needs, so that older readers read what they can.
uint32_t version_of(const LevelHeader& level, std::span<const SectionEntry> table) {
  constexpr uint32_t kLastOfVersion1 = 18, kLastOfVersion2 = 27, kLastOfVersion3 = 28, kLastOfVersion5 = 29,
                     kLastOfVersion6 = 31, kLastOfVersion7 = 32;
  const uint32_t last_section = table.empty() ? 0 : table.back().id;
  if (last_section > kLastOfVersion7) return kLevelFileVersion;
  if (last_section > kLastOfVersion6) return 7;
  if (level.medium != Medium::Flakes || last_section > kLastOfVersion5) return 6;
  if (level.highlight_lean != 0) return 5;
  if (level.open_side != vec3(0.0f) || last_section > kLastOfVersion3) return 4;
  if (level.hot_spot != 0 || last_section > kLastOfVersion2) return 3;
  return last_section <= kLastOfVersion1 ? 1 : 2;
}

LevelHeader to_level_header(const FileHeader& header) {
  LevelHeader level;
  level.level = header.level;
  level.resolution = header.resolution;
  level.bounds.lower = to_vec3(header.bounds_lower);
  level.bounds.upper = to_vec3(header.bounds_upper);
  level.brick_dims = {header.brick_dims[0], header.brick_dims[1], header.brick_dims[2]};
  level.volume_origin = to_vec3(header.volume_origin);
  level.hot_spot = header.hot_spot;
  level.open_side = to_vec3(header.open_side);
  level.highlight_lean = header.highlight_lean;
  level.medium = static_cast<Medium>(header.medium);
  level.fog_albedo = to_vec3(header.fog_albedo);
  level.fog_anisotropy = header.fog_anisotropy;
  return level;
}

/// Reads one file: header, table, arrays, in this order; each step trusts only what the steps before it proved.
class Parser {
 public:
  Parser(Bytes file, std::string_view name) : file_(file), name_(name) {}

  Result<LevelView> parse(LevelCheck check) {
    if (auto error = read_header()) return *error;
    if (auto error = read_table()) return *error;
    if (auto error = map_sections()) return *error;
    if (auto problem = find_structure_problem(view_)) return broken(*problem);
    if (check == LevelCheck::Structure) return view_;
    if (check == LevelCheck::Full) {
      if (auto error = check_bytes()) return *error;
    }
    if (auto problem = find_value_problem(view_)) return broken(*problem);
    return view_;
  }

 private:
  using Failure = std::optional<tl::unexpected<Error>>;

  tl::unexpected<Error> broken(std::string_view problem) const {
    return make_error(ErrorCode::BadFile,
                      fmt::format("broken level file {}: {}; bake the asset again", name_, problem));
  }
  tl::unexpected<Error> broken_at(uint64_t offset, std::string_view problem) const {
    return broken(fmt::format("at byte {}, {}", offset, problem));
  }

  Failure read_header() {
    if (file_.size() < kHeaderBytes) {
      return broken(fmt::format("it has {} bytes, and the header alone has {}", file_.size(), kHeaderBytes));
    }
    std::memcpy(&header_, file_.data(), kHeaderBytes);
    if (header_.magic != kLevelFileMagic) return broken_at(0, "it does not start as a level file does");
    if (header_.version > kLevelFileVersion) {
      return make_error(ErrorCode::Unsupported,
                        fmt::format("{} has level format {}, and this Farfield reads up to {}: use a newer Farfield",
                                    name_, header_.version, kLevelFileVersion));
    }
    if (header_.version == 0) return broken_at(offsetof(FileHeader, version), "the format version is 0");
    if (header_.file_bytes != file_.size()) {
      return broken_at(offsetof(FileHeader, file_bytes),
                       fmt::format("the header says {} bytes, and the file has {}", header_.file_bytes, file_.size()));
    }
    return {};
  }

  Failure read_table() {
    if (header_.section_count > (file_.size() - kHeaderBytes) / sizeof(SectionEntry)) {
      return broken_at(offsetof(FileHeader, section_count),
                       fmt::format("the table of {} sections leaves the file", header_.section_count));
    }
    const Bytes table = file_.subspan(kHeaderBytes, header_.section_count * sizeof(SectionEntry));
    if (hash_head(header_, table) != header_.head_hash) {
      return broken_at(offsetof(FileHeader, head_hash), "the checksum of header and section table does not match");
    }
    table_.resize(header_.section_count);
    if (!table.empty()) std::memcpy(table_.data(), table.data(), table.size());
    view_.header = to_level_header(header_);
    return {};
  }

  /// Matches the table against the known sections, both in ascending order, and points the view's arrays at them.
  Failure map_sections() {
    size_t next = 0;
    uint64_t end = head_bytes(table_.size());
    Failure failure;
    for_each_section(view_, [&]<typename T>(SectionId id, std::span<const T>& array) {
      if (failure || next == table_.size() || table_[next].id != static_cast<uint32_t>(id)) return;
      const SectionEntry& section = table_[next];
      failure = check_entry(section, next, sizeof(T), round_up(end, kSectionAlignment));
      if (failure) return;
      array = {reinterpret_cast<const T*>(file_.data() + section.offset), section.count};
      end = end_of(section);
      ++next;
    });
    if (failure) return failure;
    if (next < table_.size()) {
      return broken_at(entry_offset(next),
                       fmt::format("section id {} is unknown, repeated or out of order", table_[next].id));
    }
    if (round_up(end, kSectionAlignment) != file_.size()) {
      return broken(fmt::format("its sections end at byte {}, and the file has {}", end, file_.size()));
    }
    return {};
  }

  Failure check_entry(const SectionEntry& section, size_t index, size_t element_bytes, uint64_t offset) const {
    const auto bad = [&](std::string_view problem) {
      return broken_at(entry_offset(index),
                       fmt::format("section {} {}", section_name(static_cast<SectionId>(section.id)), problem));
    };
    if (section.element_bytes != element_bytes) {
      return bad(fmt::format("has elements of {} bytes, expected {}", section.element_bytes, element_bytes));
    }
    // Only now may the product be formed: it is at most the file's size.
    if (section.count == 0 || section.count > file_.size() / element_bytes) {
      return bad(fmt::format("has {} elements in a file of {} bytes", section.count, file_.size()));
    }
    if (section.bytes != section.count * element_bytes) {
      return bad(fmt::format("has {} bytes, expected {} for {} elements", section.bytes, section.count * element_bytes,
                             section.count));
    }
    if (section.offset != offset) return bad(fmt::format("lies at byte {}, expected {}", section.offset, offset));
    if (end_of(section) > file_.size()) return bad("leaves the file");
    return {};
  }

  /// Every byte of the file is under a checksum (header, table, sections) or is padding, which is 0.
  Failure check_bytes() const {
    uint64_t end = head_bytes(table_.size());
    for (const SectionEntry& section : table_) {
      if (auto error = check_padding(end, section.offset)) return error;
      if (hash_bytes(file_.subspan(section.offset, section.bytes)) != section.hash) {
        return broken_at(section.offset, fmt::format("the checksum of section {} does not match",
                                                     section_name(static_cast<SectionId>(section.id))));
      }
      end = section.offset + section.bytes;
    }
    return check_padding(end, file_.size());
  }

  Failure check_padding(uint64_t begin, uint64_t end) const {
    for (uint64_t i = begin; i < end; ++i) {
      if (file_[i] != std::byte{0}) return broken_at(i, "padding is not 0");
    }
    return {};
  }

  static uint64_t entry_offset(size_t index) { return head_bytes(index); }

  Bytes file_;
  std::string_view name_;
  FileHeader header_{};
  std::vector<SectionEntry> table_;
  LevelView view_;
};

}  // namespace

std::string_view section_name(SectionId id) {
  switch (id) {
#define FARFIELD_NAME(id, Name, field, Element, Group) \
  case SectionId::Name:                                \
    return #field;
    FARFIELD_LEVEL_ARRAYS(FARFIELD_NAME)
#undef FARFIELD_NAME
  }
  return "unknown";
}

LevelLayout layout_of(const LevelView& level) {
  LevelLayout layout;
  for_each_section(level, [&]<typename T>(SectionId id, std::span<const T> array) {
    if (!array.empty()) {
      layout.sections.push_back({static_cast<uint32_t>(id), sizeof(T), array.size(), 0, array.size_bytes(), 0});
    }
  });
  uint64_t end = head_bytes(layout.sections.size());
  for (SectionEntry& section : layout.sections) {
    section.offset = round_up(end, kSectionAlignment);
    end = end_of(section);
  }
  layout.file_bytes = round_up(end, kSectionAlignment);
  return layout;
}

std::vector<std::byte> encode_head(const LevelView& level, const LevelLayout& layout) {
  std::vector<SectionEntry> table = layout.sections;
  size_t next = 0;
  for_each_section(level, [&]<typename T>(SectionId, std::span<const T> array) {
    if (!array.empty()) table[next++].hash = hash_values(array);
  });

  FileHeader header{};
  header.magic = kLevelFileMagic;
  header.version = version_of(level.header, table);
  header.section_count = static_cast<uint32_t>(table.size());
  header.file_bytes = layout.file_bytes;
  header.level = level.header.level;
  header.resolution = level.header.resolution;
  copy_to(header.bounds_lower, level.header.bounds.lower);
  copy_to(header.bounds_upper, level.header.bounds.upper);
  header.brick_dims = {level.header.brick_dims.x, level.header.brick_dims.y, level.header.brick_dims.z};
  copy_to(header.volume_origin, level.header.volume_origin);
  header.hot_spot = level.header.hot_spot;
  copy_to(header.open_side, level.header.open_side);
  header.highlight_lean = level.header.highlight_lean;
  header.medium = static_cast<uint32_t>(level.header.medium);
  copy_to(header.fog_albedo, level.header.fog_albedo);
  header.fog_anisotropy = level.header.fog_anisotropy;
  header.head_hash = hash_head(header, std::as_bytes(std::span(table)));

  std::vector<std::byte> head(head_bytes(table.size()));
  std::memcpy(head.data(), &header, kHeaderBytes);
  if (!table.empty()) std::memcpy(head.data() + kHeaderBytes, table.data(), table.size() * sizeof(SectionEntry));
  return head;
}

void seal_head(std::span<std::byte> file) {
  FileHeader header;
  if (file.size() < kHeaderBytes) return;
  std::memcpy(&header, file.data(), kHeaderBytes);
  if (header.section_count > (file.size() - kHeaderBytes) / sizeof(SectionEntry)) return;
  header.head_hash = hash_head(header, file.subspan(kHeaderBytes, header.section_count * sizeof(SectionEntry)));
  std::memcpy(file.data(), &header, kHeaderBytes);
}

Result<LevelView> parse_level(Bytes bytes, LevelCheck check, std::string_view name) {
  FARFIELD_CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % kSectionAlignment == 0);
  return Parser(bytes, name).parse(check);
}

}  // namespace farfield
