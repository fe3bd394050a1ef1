#include "renderer/openimageio/tile_lookup.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>

#include "base/text/text.h"
#include "renderer/textures/texture.h"

namespace tensorray::openimageio {
namespace {

#if OIIO_VERSION_MAJOR >= 3
using TextureSystemPtr = std::shared_ptr<OIIO::TextureSystem>;
#else
struct DestroyTextureSystem {
  void operator()(OIIO::TextureSystem* system) const { OIIO::TextureSystem::destroy(system); }
};
using TextureSystemPtr = std::unique_ptr<OIIO::TextureSystem, DestroyTextureSystem>;
#endif

const char* const source_attribute = "tensorray:source";

/// Presents a source to OpenImageIO's cache tile by tile. Each level is a separate picture (a subimage) and not a MIP
/// level: OpenImageIO would choose the MIP level by the shorter side alone, which blurs pictures that are not square.
class SourceInput final : public OIIO::ImageInput {
 public:
  const char* format_name() const override { return "tensorray tiles"; }
  int supports(OIIO::string_view feature) const override { return feature == "procedural"; }

  bool open(const std::string& name, OIIO::ImageSpec& spec) override { return open(name, spec, {}); }

  bool open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
    const OIIO::ParamValue* const parameter = config.find_attribute(source_attribute, OIIO::TypeDesc::PTR);
    if (!parameter) return false;
    source_ = *static_cast<const TileSource* const*>(parameter->data());
    m_spec = level_spec(0);
    spec = m_spec;
    return true;
  }

  bool close() override { return true; }
  int current_subimage() const override { return level_; }

  bool seek_subimage(int level, int miplevel) override {
    if (level < 0 || level >= source_->levels() || miplevel != 0) return false;
    level_ = level;
    m_spec = level_spec(level);
    return true;
  }

  // The following functions need no lock: they do not use the current subimage.
  using OIIO::ImageInput::spec;
  OIIO::ImageSpec spec(int level, int miplevel) override { return spec_dimensions(level, miplevel); }
  OIIO::ImageSpec spec_dimensions(int level, int miplevel) override {
    return level < 0 || level >= source_->levels() || miplevel != 0 ? OIIO::ImageSpec() : level_spec(level);
  }

  bool read_native_scanline(int, int, int, int, void*) override { return false; }

  bool read_native_tile(int level, int, int x, int y, int, void* data) override {
    try {
      float* const rgba = static_cast<float*>(data);
      std::fill_n(rgba, tile_size * tile_size * 4, 0.0f);
      const int columns = std::min(tile_size, source_->width(level) - x);
      const int rows = std::min(tile_size, source_->height(level) - y);
      source_->read({level, x, y, columns, rows}, tile_size, rgba);
      return true;
    } catch (const std::exception& error) {
      errorfmt("{}", error.what());
      return false;
    }
  }

 private:
  static constexpr int tile_size = 64;

  OIIO::ImageSpec level_spec(int level) const {
    OIIO::ImageSpec spec(source_->width(level), source_->height(level), 4, OIIO::TypeDesc::FLOAT);
    spec.tile_width = spec.tile_height = tile_size;
    spec.tile_depth = 1;
    return spec;
  }

  const TileSource* source_ = nullptr;
  int level_ = 0;
};

OIIO::TextureOpt make_options(Wrap wrap) {
  OIIO::TextureOpt options;
  options.mipmode = OIIO::TextureOpt::MipModeNoMIP;
  options.interpmode = OIIO::TextureOpt::InterpBilinear;
  options.swrap = wrap == Wrap::none     ? OIIO::TextureOpt::WrapBlack
                  : wrap == Wrap::clamp  ? OIIO::TextureOpt::WrapClamp
                  : wrap == Wrap::repeat ? OIIO::TextureOpt::WrapPeriodic
                                         : OIIO::TextureOpt::WrapMirror;
  options.twrap = options.swrap;
  return options;
}

class TextureSystemLookup final : public TileLookup {
 public:
  TextureSystemLookup(const TileSource& source, Wrap wrap) : options_(make_options(wrap)) {
    system_->attribute("max_memory_MB", 1024.0f);
    const OIIO::ustring file("picture");  // Each texture has its own cache, so that the name need not be unique.
    const TileSource* const pointer = &source;
    OIIO::ImageSpec config;
    config.attribute(source_attribute, OIIO::TypeDesc::PTR, &pointer);
    const auto create = []() -> OIIO::ImageInput* { return new SourceInput; };
    if (!system_->imagecache()->add_file(file, create, &config)) fail();
    handle_ = system_->get_texture_handle(file);
    if (!system_->good(handle_)) fail();
  }

  void* this_thread() const override { return system_->get_perthread_info(); }

  void lookup(void* thread, int level, bool closest, float s, float t, float* rgba) const override {
    OIIO::TextureOpt options = options_;
    options.subimage = level;
    if (closest) options.interpmode = OIIO::TextureOpt::InterpClosest;
    if (!system_->texture(handle_, static_cast<OIIO::TextureSystem::Perthread*>(thread), options, s, t, 0, 0, 0, 0, 4,
                          rgba))
      fail();
  }

 private:
  [[noreturn]] void fail() const { throw std::runtime_error(one_line(system_->geterror())); }

  OIIO::TextureOpt options_;
  TextureSystemPtr system_{OIIO::TextureSystem::create(false)};
  OIIO::TextureSystem::TextureHandle* handle_ = nullptr;
};

}  // namespace

std::unique_ptr<TileLookup> make_lookup(const TileSource& source, Wrap wrap) {
  return std::make_unique<TextureSystemLookup>(source, wrap);
}

}  // namespace tensorray::openimageio
