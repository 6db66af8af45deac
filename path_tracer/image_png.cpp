// SPDX-License-Identifier: Apache-2.0
// PNG previews, line by line: see image_exr.cpp.
#include <fmt/format.h>
#include <png.h>

#include <csetjmp>

#include "base/srgb.h"
#include "base/temporary_file.h"
#include "path_tracer/image.h"

namespace farfield {

namespace {

// libpng's own file writing ignores a full disk; the temporary file remembers it.
void write_bytes(png_structp png, png_bytep data, size_t bytes) {
  auto& file = *static_cast<TemporaryFile*>(png_get_io_ptr(png));
  if (!file.write(std::as_bytes(std::span(data, bytes)))) png_error(png, "cannot write");  // commit() has the reason
}

void flush_nothing(png_structp) {}

// libpng calls this, and then jumps: what failed is kept for the message.
void keep_message(png_structp png, png_const_charp message) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

class PngWriter {
 public:
  PngWriter()
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &error_, keep_message, ignore_warning)),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {}
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  /// False if libpng failed; error() then says why. fill_line puts row y, as RGB bytes, into `line` and cannot throw.
  template <typename FillLine>
  bool write(TemporaryFile& file, int width, int height, std::vector<uint8_t>& line, const FillLine& fill_line) {
    if (!png_ || !info_) return false;
    if (setjmp(png_jmpbuf(png_))) return false;  // nothing with a destructor lives between here and the jump
    png_set_write_fn(png_, &file, write_bytes, flush_nothing);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png_, info_, PNG_sRGB_INTENT_ABSOLUTE);
    png_write_info(png_, info_);
    for (int y = 0; y < height; ++y) {
      fill_line(y);
      png_write_row(png_, line.data());
    }
    png_write_end(png_, nullptr);
    return true;
  }
  const std::string& error() const { return error_; }

 private:
  std::string error_ = "libpng has no memory";
  png_structp png_;
  png_infop info_;
};

}  // namespace

Result<void> write_png(const std::filesystem::path& path, const Image& image, const PngOptions& options) {
  if (image.values.empty())
    return make_error(ErrorCode::InvalidArgument, fmt::format("{}: empty image", path.string()));
  const float gain = std::exp2(options.exposure_stops);
  const std::array<int, 3> rgb = rgb_channels(image);
  std::vector<uint8_t> line(static_cast<size_t>(image.width) * 3);
  const auto fill_line = [&](int y) {
    for (int x = 0; x < image.width; ++x)
      for (size_t c = 0; c < 3; ++c)
        line[static_cast<size_t>(x) * 3 + c] = rgb[c] < 0 ? 0 : srgb_byte(gain * image.pixel(x, y)[rgb[c]]);
  };
  TemporaryFile temporary(path);
  PngWriter writer;
  if (!writer.write(temporary, image.width, image.height, line, fill_line) && temporary.is_good())
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), writer.error()));
  return temporary.commit();
}

}  // namespace farfield
