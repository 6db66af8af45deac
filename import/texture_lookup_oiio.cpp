// SPDX-License-Identifier: Apache-2.0
// Lookups through an OpenImageIO texture system of our own: the host's shared one keeps its settings.
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <deque>

#include "import/texture_oiio.h"

namespace farfield {
namespace {

OIIO::TextureOpt::Wrap to_oiio(Wrap wrap) {
  switch (wrap) {
    case Wrap::Clamp:
      return OIIO::TextureOpt::WrapClamp;
    case Wrap::Mirror:
      return OIIO::TextureOpt::WrapMirror;
    case Wrap::Repeat:
      break;
  }
  return OIIO::TextureOpt::WrapPeriodic;
}

class OiioLookup final : public TextureLookup {
 public:
  OiioLookup() : system_(OIIO::TextureSystem::create(/*shared=*/false)) {
    system_->attribute("max_open_files", 100);
    set_cache_bytes(kSmallestTextureCache);
  }
  ~OiioLookup() override { OIIO::TextureSystem::destroy(system_, /*teardown_imagecache=*/true); }
  OiioLookup(const OiioLookup&) = delete;
  OiioLookup& operator=(const OiioLookup&) = delete;

  void set_cache_bytes(uint64_t bytes) override {
    system_->attribute("max_memory_MB", static_cast<float>(static_cast<double>(bytes) / (1 << 20)));
  }

  uint32_t add(const std::string& path, Wrap wrap_u, Wrap wrap_v) override {
    textures_.push_back({OIIO::ustring(path), to_oiio(wrap_u), to_oiio(wrap_v)});
    return static_cast<uint32_t>(textures_.size() - 1);
  }

  bool look_up(uint32_t texture, const TextureFootprint& at, int channels, float* values) const override {
    const File& file = textures_[texture];
    OIIO::TextureOpt options;
    options.swrap = file.wrap_u;
    options.twrap = file.wrap_v;
    options.interpmode = OIIO::TextureOpt::InterpBilinear;
    options.anisotropic = 16;
    options.conservative_filter = false;
    OIIO::TextureSystem::Perthread* thread = system_->get_perthread_info();
    OIIO::TextureSystem::TextureHandle* handle = system_->get_texture_handle(file.path, thread);
    return system_->texture(handle, thread, options, at.u, at.v, at.du_dx, at.dv_dx, at.du_dy, at.dv_dy, channels,
                            values);
  }

  std::string error() const override { return system_->geterror(); }
  void clear() override { system_->invalidate_all(true); }

 private:
  struct File {
    OIIO::ustring path;
    OIIO::TextureOpt::Wrap wrap_u, wrap_v;
  };

  OIIO::TextureSystem* system_;
  std::deque<File> textures_;
};

}  // namespace

std::unique_ptr<TextureLookup> make_texture_lookup() { return std::make_unique<OiioLookup>(); }

}  // namespace farfield
