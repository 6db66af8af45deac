// SPDX-License-Identifier: Apache-2.0
// OpenEXR files, written line by line straight from the image, so that a frame needs next to no further memory.
#include <ImfChannelList.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>
#include <ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <system_error>

#include "base/temporary_file.h"
#include "path_tracer/image.h"

namespace farfield {

namespace {

// Larger images than this are taken for broken files: 4 GiB of floats.
constexpr uint64_t kMostValues = uint64_t{1} << 30;

// Attributes with a meaning of their own in the format; all others are metadata.
constexpr std::array kFormatAttributes = {
    "channels", "chunkCount",       "compression",        "dataWindow",        "displayWindow", "lineOrder", "name",
    "tiles",    "pixelAspectRatio", "screenWindowCenter", "screenWindowWidth", "type",          "version"};

// OpenEXR's destructors swallow the errors of the last writes; the temporary file remembers them.
class ExrStream : public Imf::OStream {
 public:
  ExrStream(TemporaryFile& file, const std::filesystem::path& name) : OStream(name.c_str()), file_(file) {}
  void write(const char* data, int bytes) override {
    check(file_.write(std::as_bytes(std::span(data, static_cast<size_t>(bytes)))));
  }
  uint64_t tellp() override { return file_.position(); }
  void seekp(uint64_t position) override { check(file_.seek(position)); }

 private:
  static void check(bool succeeded) {
    if (!succeeded) throw std::runtime_error("cannot write");  // commit() has the reason
  }
  TemporaryFile& file_;
};

void insert_metadata(Imf::Header& header, const Metadata& metadata) {
  for (const auto& [name, value] : metadata) {
    if (const auto* i = std::get_if<int>(&value)) header.insert(name, Imf::IntAttribute(*i));
    if (const auto* f = std::get_if<float>(&value)) header.insert(name, Imf::FloatAttribute(*f));
    if (const auto* v = std::get_if<vec3>(&value)) header.insert(name, Imf::V3fAttribute(Imath::V3f(v->x, v->y, v->z)));
    if (const auto* s = std::get_if<std::string>(&value)) header.insert(name, Imf::StringAttribute(*s));
  }
}

Metadata extract_metadata(const Imf::Header& header) {
  Metadata metadata;
  for (auto it = header.begin(); it != header.end(); ++it) {
    const std::string name = it.name();
    if (std::find(kFormatAttributes.begin(), kFormatAttributes.end(), name) != kFormatAttributes.end()) continue;
    const Imf::Attribute& attribute = it.attribute();
    if (const auto* i = dynamic_cast<const Imf::IntAttribute*>(&attribute)) metadata[name] = i->value();
    if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(&attribute)) metadata[name] = f->value();
    if (const auto* v = dynamic_cast<const Imf::V3fAttribute*>(&attribute))
      metadata[name] = vec3(v->value().x, v->value().y, v->value().z);
    if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(&attribute)) metadata[name] = s->value();
  }
  return metadata;
}

// Slices of an interleaved image whose pixel (0, 0) lies at (min_x, min_y) of the file's data window.
Imf::FrameBuffer slices_of(char* values, const Image& image, int min_x, int min_y) {
  const size_t x_stride = image.channel_count() * sizeof(float);
  const size_t y_stride = x_stride * static_cast<size_t>(image.width);
  Imf::FrameBuffer buffer;
  for (size_t c = 0; c < image.channel_count(); ++c) {
    char* base = values + c * sizeof(float) - static_cast<ptrdiff_t>(x_stride) * min_x -
                 static_cast<ptrdiff_t>(y_stride) * min_y;
    buffer.insert(image.channels[c], Imf::Slice(Imf::FLOAT, base, x_stride, y_stride));
  }
  return buffer;
}

// R, G, B, A first, the rest as the file sorts them: by name.
std::vector<std::string> ordered_channels(const Imf::ChannelList& list) {
  std::vector<std::string> names;
  for (const char* name : {"R", "G", "B", "A"})
    if (list.findChannel(name)) names.emplace_back(name);
  const size_t color_count = names.size();
  for (auto it = list.begin(); it != list.end(); ++it) {
    const auto color_end = names.begin() + static_cast<ptrdiff_t>(color_count);
    if (std::find(names.begin(), color_end, it.name()) == color_end) names.emplace_back(it.name());
  }
  return names;
}

ExrFile read_open_file(Imf::InputFile& file, const Imath::Box2i& window) {
  ExrFile result;
  result.image = Image(window.max.x - window.min.x + 1, window.max.y - window.min.y + 1,
                       ordered_channels(file.header().channels()));
  result.metadata = extract_metadata(file.header());
  file.setFrameBuffer(
      slices_of(reinterpret_cast<char*>(result.image.values.data()), result.image, window.min.x, window.min.y));
  file.readPixels(window.min.y, window.max.y);
  return result;
}

}  // namespace

Result<void> write_exr(const std::filesystem::path& path, const Image& image, const Metadata& metadata) {
  if (image.values.empty())
    return make_error(ErrorCode::InvalidArgument, fmt::format("{}: empty image", path.string()));
  TemporaryFile temporary(path);
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = Imf::ZIPS_COMPRESSION;  // one line at a time: the least working memory
    for (const std::string& name : image.channels) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    insert_metadata(header, metadata);
    ExrStream stream(temporary, path);
    Imf::OutputFile file(stream, header, 0);
    // OpenEXR only reads through these pointers when it writes a file.
    char* values = reinterpret_cast<char*>(const_cast<float*>(image.values.data()));
    file.setFrameBuffer(slices_of(values, image, 0, 0));
    file.writePixels(image.height);
  } catch (const std::exception& error) {
    if (temporary.is_good())
      return make_error(ErrorCode::Io, fmt::format("cannot write {}: {}", path.string(), error.what()));
  }
  return temporary.commit();
}

Result<ExrFile> read_exr(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    return make_error(ErrorCode::NotFound, fmt::format("{}: no such file", path.string()));
  try {
    Imf::InputFile file(path.c_str(), 0);
    const Imf::Header& header = file.header();
    if (header.hasType() && Imf::isDeepData(header.type()))
      return make_error(ErrorCode::Unsupported, fmt::format("{}: deep images are not supported", path.string()));
    const Imath::Box2i window = header.dataWindow();
    const auto width = uint64_t(int64_t{window.max.x} - window.min.x + 1);
    const auto height = uint64_t(int64_t{window.max.y} - window.min.y + 1);
    uint64_t channel_count = 0;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
      ++channel_count;
      if (it.channel().xSampling != 1 || it.channel().ySampling != 1)
        return make_error(ErrorCode::Unsupported,
                          fmt::format("{}: channel {} is subsampled; save it as RGB", path.string(), it.name()));
    }
    if (channel_count == 0) return make_error(ErrorCode::BadFile, fmt::format("{}: no channels", path.string()));
    if (width > kMostValues || height > kMostValues || width * height > kMostValues / channel_count)
      return make_error(ErrorCode::BadFile, fmt::format("{}: {} x {} pixels of {} channels are more than {} values",
                                                        path.string(), width, height, channel_count, kMostValues));
    return read_open_file(file, window);
  } catch (const std::exception& error) {
    return make_error(ErrorCode::BadFile, fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace farfield
