// SPDX-License-Identifier: Apache-2.0
// PNG previews through OpenImageIO, line by line: see image_exr.cpp.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/temporary_file.h"
#include "path_tracer/image.h"

namespace farfield {

namespace {

// [IEC 61966-2-1]
uint8_t srgb_byte(float linear) {
  const float x = linear > 0 ? std::min(linear, 1.0f) : 0.0f;  // NaN becomes 0
  const float encoded = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
  return static_cast<uint8_t>(255.0f * encoded + 0.5f);
}

// OpenImageIO's PNG writer ignores a full disk; the temporary file remembers it.
class PngStream : public OIIO::Filesystem::IOProxy {
 public:
  PngStream(TemporaryFile& file, const std::filesystem::path& name) : IOProxy(name.string(), Write), file_(file) {}
  const char* proxytype() const override { return "file"; }
  size_t write(const void* data, size_t bytes) override {
    return file_.write({static_cast<const std::byte*>(data), bytes}) ? bytes : 0;
  }
  bool seek(int64_t position) override { return file_.seek(static_cast<uint64_t>(position)); }
  int64_t tell() override { return static_cast<int64_t>(file_.position()); }

 private:
  TemporaryFile& file_;
};

}  // namespace

Result<void> write_png(const std::filesystem::path& path, const Image& image, const PngOptions& options) {
  if (image.values.empty())
    return make_error(ErrorCode::InvalidArgument, fmt::format("{}: empty image", path.string()));
  TemporaryFile temporary(path);
  const auto failed = [&](const std::string& why) -> Result<void> {
    if (!temporary.is_good()) return temporary.commit();  // it knows the reason
    return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), why));
  };
  PngStream stream(temporary, path);
  const auto output = OIIO::ImageOutput::create("png");
  if (!output) return failed(OIIO::geterror());
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  output->set_ioproxy(&stream);
  if (!output->open(path.string(), spec)) return failed(output->geterror());

  const float gain = std::exp2(options.exposure_stops);
  const std::array<int, 3> rgb = rgb_channels(image);
  std::vector<uint8_t> line(static_cast<size_t>(image.width) * 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x)
      for (size_t c = 0; c < 3; ++c)
        line[static_cast<size_t>(x) * 3 + c] = rgb[c] < 0 ? 0 : srgb_byte(gain * image.pixel(x, y)[rgb[c]]);
    if (!output->write_scanline(y, 0, OIIO::TypeDesc::UINT8, line.data())) return failed(output->geterror());
  }
  if (!output->close()) return failed(output->geterror());
  return temporary.commit();
}

}  // namespace farfield
