// SPDX-License-Identifier: Apache-2.0
#include "cache/level_file.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

#include "base/file_io.h"
#include "base/hash.h"
#include "base/result.h"
#include "cache/level_check.h"
#include "cache/level_format.h"

namespace farfield {

namespace {

using Bytes = std::span<const std::byte>;

/// At least what can lie between two sections: the padding after positions and less than 64 bytes of alignment.
constexpr std::array<std::byte, kSectionAlignment + kPositionsPadding> kZeros{};

std::vector<Bytes> section_bytes(const LevelView& level) {
  std::vector<Bytes> sections;
  for_each_section(level, [&](SectionId, const auto& array) {
    if (!array.empty()) sections.push_back(std::as_bytes(array));
  });
  return sections;
}

/// A range of a file, in bytes.
struct FileRange {
  uint64_t begin = 0;
  uint64_t end = 0;
};

/// Which sections rays read: with texture coordinates they need the triangles too.
struct RaysRead {
  bool triangles;

  explicit RaysRead(const LevelLayout& layout)
      : triangles(std::ranges::any_of(layout.sections, [](const SectionEntry& section) {
          return static_cast<SectionId>(section.id) == SectionId::ShadingUv;
        })) {}

  bool operator()(const SectionEntry& section) const {
    const auto id = static_cast<SectionId>(section.id);
    if (id == SectionId::Positions || id == SectionId::Quads) return triangles;
    return id != SectionId::MorphVertex && id != SectionId::MorphFace;
  }
};

/// The whole pages that hold only sections which rays do not read.
std::vector<FileRange> build_only_pages(const LevelLayout& layout) {
  const RaysRead rays_read(layout);
  std::vector<FileRange> ranges;
  for (size_t i = 0; i < layout.sections.size(); ++i) {
    if (rays_read(layout.sections[i])) continue;
    const bool continues = i > 0 && !rays_read(layout.sections[i - 1]);
    if (!continues) ranges.push_back({round_up(layout.sections[i].offset, kPageBytes), 0});
    const bool is_last = i + 1 == layout.sections.size();
    ranges.back().end =
        is_last ? round_up(layout.file_bytes, kPageBytes) : layout.sections[i + 1].offset / kPageBytes * kPageBytes;
  }
  std::erase_if(ranges, [](const FileRange& range) { return range.begin >= range.end; });
  return ranges;
}

}  // namespace

Result<uint64_t> write_level(const std::filesystem::path& path, const LevelView& view) {
  auto problem = find_structure_problem(view);
  if (!problem) problem = find_value_problem(view);
  if (problem) {
    return make_error(ErrorCode::InvalidArgument,
                      fmt::format("cannot write level {} to {}: {}", view.header.level, path.string(), *problem));
  }

  const LevelLayout layout = layout_of(view);
  const std::vector<std::byte> head = encode_head(view, layout);
  const std::vector<Bytes> sections = section_bytes(view);
  std::vector<Bytes> pieces = {head};
  uint64_t end = head.size();
  for (size_t i = 0; i < sections.size(); ++i) {
    pieces.push_back(Bytes(kZeros).first(layout.sections[i].offset - end));
    pieces.push_back(sections[i]);
    end = layout.sections[i].offset + sections[i].size();
  }
  pieces.push_back(Bytes(kZeros).first(layout.file_bytes - end));

  if (const Result<void> written = write_file_atomically(path, pieces); !written) {
    return tl::unexpected(written.error());
  }
  return layout.file_bytes;
}

LevelFileSizes level_file_sizes(const LevelView& level) {
  const LevelLayout layout = layout_of(level);
  uint64_t build_only = 0;
  for (const FileRange& range : build_only_pages(layout)) build_only += range.end - range.begin;
  return {layout.file_bytes, round_up(layout.file_bytes, kPageBytes), build_only};
}

Result<std::unique_ptr<LevelFile>> LevelFile::read(const std::filesystem::path& path,
                                                   std::optional<uint64_t> expected_bytes) {
  FARFIELD_TRY_LET(const auto file, open_regular_file(path));
  if (expected_bytes && file.bytes != *expected_bytes) {
    return make_error(ErrorCode::BadFile, fmt::format("broken level file {}: {} bytes where its manifest says {}; bake "
                                                      "the asset again",
                                                      path.string(), file.bytes, *expected_bytes));
  }
  if (file.bytes == 0) {
    return make_error(ErrorCode::BadFile,
                      fmt::format("broken level file {}: it is empty; bake the asset again", path.string()));
  }
  // Pages of their own, not the heap's: parts of them are given back, and `ps` counts what the budget does.
  void* pages = ::mmap(nullptr, file.bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) {
    return make_error(ErrorCode::Io, fmt::format("cannot load {} into memory: {}", path.string(), system_words(errno)));
  }
  std::unique_ptr<LevelFile> level(new LevelFile);  // owns the pages from here on
  level->bytes_ = static_cast<std::byte*>(pages);
  level->file_bytes_ = file.bytes;
  FARFIELD_TRY(read_fully(file.descriptor.get(), {level->bytes_, level->file_bytes_}, path));
  ::mprotect(pages, file.bytes, PROT_READ);  // a failure only means that a stray write would not be noticed
  return level;
}

Result<void> LevelFile::parse(LevelCheck check, const std::filesystem::path& path) {
  FARFIELD_TRY_LET(view_, parse_level(bytes(), check, path.string()));
  return {};
}

Result<std::unique_ptr<LevelFile>> LevelFile::open(const std::filesystem::path& path, LevelCheck check) {
  FARFIELD_TRY_LET(auto level, read(path));
  FARFIELD_TRY(level->parse(check, path));
  return level;
}

Result<std::unique_ptr<LevelFile>> LevelFile::open_known(const std::filesystem::path& path, uint64_t file_bytes,
                                                         uint64_t file_hash) {
  FARFIELD_TRY_LET(auto level, read(path, file_bytes));
  if (hash_bytes(level->bytes()) != file_hash) {
    // Not what the manifest means: damaged, which the checksums say better, or a sound file of another bake.
    FARFIELD_TRY(level->parse(LevelCheck::Full, path));
    return make_error(ErrorCode::BadFile, fmt::format("{} is not the file that its manifest meant when the asset was "
                                                      "opened; open it again, or bake it again",
                                                      path.string()));
  }
  FARFIELD_TRY(level->parse(LevelCheck::Values, path));
  return level;
}

LevelFile::~LevelFile() {
  if (bytes_ != nullptr) ::munmap(bytes_, file_bytes_);
}

uint64_t LevelFile::build_only_bytes() const { return level_file_sizes(view_).build_only_bytes; }

void LevelFile::release_build_pages() {
  for (const FileRange& pages : build_only_pages(layout_of(view_))) {
    std::byte* const begin = bytes_ + pages.begin;
    const uint64_t bytes = pages.end - pages.begin;
    // A failure (pages locked by the host, a system with larger pages) only means that the memory stays in use.
    ::madvise(begin, bytes, MADV_DONTNEED);
    ::madvise(begin, bytes, MADV_NOHUGEPAGE);  // or the system may fill them again to make large pages
  }
}

}  // namespace farfield
