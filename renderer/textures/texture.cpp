#include "renderer/textures/texture.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>

#include "base/text.h"
#include "renderer/textures/image_pyramid.h"

namespace tensorray {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector4f;

#if OIIO_VERSION_MAJOR >= 3
using TextureSystemPtr = std::shared_ptr<OIIO::TextureSystem>;
#else
struct DestroyTextureSystem {
  void operator()(OIIO::TextureSystem* system) const { OIIO::TextureSystem::destroy(system); }
};
using TextureSystemPtr = std::unique_ptr<OIIO::TextureSystem, DestroyTextureSystem>;
#endif

const char* const pyramid_attribute = "tensorray:pyramid";

/// Presents a pyramid to OpenImageIO's cache tile by tile. Each level is a separate picture (a subimage) and not a MIP
/// level: OpenImageIO would choose the MIP level by the shorter side alone, which blurs pictures that are not square.
class PyramidInput final : public OIIO::ImageInput {
 public:
  const char* format_name() const override { return "tensorray pyramid"; }
  int supports(OIIO::string_view feature) const override { return feature == "procedural"; }

  bool open(const std::string& name, OIIO::ImageSpec& spec) override { return open(name, spec, {}); }

  bool open(const std::string&, OIIO::ImageSpec& spec, const OIIO::ImageSpec& config) override {
    const OIIO::ParamValue* const parameter = config.find_attribute(pyramid_attribute, OIIO::TypeDesc::PTR);
    if (!parameter) return false;
    pyramid_ = *static_cast<const ImagePyramid* const*>(parameter->data());
    m_spec = level_spec(0);
    spec = m_spec;
    return true;
  }

  bool close() override { return true; }
  int current_subimage() const override { return level_; }

  bool seek_subimage(int level, int miplevel) override {
    if (level < 0 || level >= pyramid_->levels() || miplevel != 0) return false;
    level_ = level;
    m_spec = level_spec(level);
    return true;
  }

  // The following functions need no lock: they do not use the current subimage.
  using OIIO::ImageInput::spec;
  OIIO::ImageSpec spec(int level, int miplevel) override { return spec_dimensions(level, miplevel); }
  OIIO::ImageSpec spec_dimensions(int level, int miplevel) override {
    return level < 0 || level >= pyramid_->levels() || miplevel != 0 ? OIIO::ImageSpec() : level_spec(level);
  }

  bool read_native_scanline(int, int, int, int, void*) override { return false; }

  bool read_native_tile(int level, int, int x, int y, int, void* data) override {
    try {
      float* const rgba = static_cast<float*>(data);
      std::fill_n(rgba, tile_size * tile_size * 4, 0.0f);
      const int columns = std::min(tile_size, pyramid_->width(level) - x);
      const int rows = std::min(tile_size, pyramid_->height(level) - y);
      pyramid_->read(level, x, y, columns, rows, tile_size, rgba);
      return true;
    } catch (const std::exception& error) {
      errorfmt("{}", error.what());
      return false;
    }
  }

 private:
  static constexpr int tile_size = 64;

  OIIO::ImageSpec level_spec(int level) const {
    OIIO::ImageSpec spec(pyramid_->width(level), pyramid_->height(level), 4, OIIO::TypeDesc::FLOAT);
    spec.tile_width = spec.tile_height = tile_size;
    spec.tile_depth = 1;
    return spec;
  }

  const ImagePyramid* pyramid_ = nullptr;
  int level_ = 0;
};

/// The ellipse of the picture that a pixel sees, in texels.
struct Ellipse {
  double major = 1;                       ///< Length of the longer axis (for a circular pixel, its diameter).
  double minor = 1;                       ///< Length of the shorter axis.
  Vector2d direction = Vector2d::Zero();  ///< Direction of the longer axis, unit.
};

/// The image of the unit circle under `footprint`, by its singular values.
Ellipse make_ellipse(const Matrix2d& footprint) {
  const Matrix2d square = footprint * footprint.transpose();
  const double middle = 0.5 * (square(0, 0) + square(1, 1)), difference = 0.5 * (square(0, 0) - square(1, 1));
  const double radius = std::hypot(difference, square(0, 1)), angle = 0.5 * std::atan2(square(0, 1), difference);
  return {std::sqrt(middle + radius), std::sqrt(std::max(0.0, middle - radius)), {std::cos(angle), std::sin(angle)}};
}

/// Whether a footprint is finite and small enough for a filter; a larger one gives the mean of the picture.
bool is_resolved(const Matrix2d& footprint) { return (footprint.array().abs() < 1e6).all(); }

/// Limits the ellipse: no axis is shorter than a texel, and the ratio of the axes does not need too many probes.
Ellipse limit(Ellipse ellipse, double longest) {
  constexpr double largest_ratio = 32;
  ellipse.minor = std::max({ellipse.minor, 1.0, ellipse.major / largest_ratio});
  ellipse.major = std::clamp(ellipse.major, ellipse.minor, std::max(longest, ellipse.minor));
  return ellipse;
}

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

/// The equivalent coordinate near the picture, where single precision resolves it.
double bring_near(double coordinate, Wrap wrap) {
  if (wrap == Wrap::repeat) return coordinate - std::floor(coordinate);
  if (wrap == Wrap::mirror) return coordinate - 2 * std::floor(coordinate / 2);
  return std::clamp(coordinate, -1.0, 2.0);
}

/// Whether a coordinate is equal to the centre of a texel in single precision.
bool is_centre(double coordinate, int size) {
  const double texel = coordinate * size - 0.5;
  return std::abs(texel - std::round(texel)) <= size * 0x1p-22;
}

/// The levels to mix: `blend` is the weight of level + 1.
struct LevelChoice {
  int level;
  float blend;
};

/// Texels of level L are 2^L texels large. Between two levels the weight is linear in the size.
LevelChoice choose_level(double size, int levels) {
  constexpr double rounding = 1e-3;  // Tolerance for a footprint of one texel that was computed with errors.
  if (size <= 1 + rounding) return {0, 0.0f};
  const int level = std::ilogb(size);
  if (level >= levels - 1) return {levels - 1, 0.0f};
  return {level, static_cast<float>(std::ldexp(size, -level) - 1)};
}

}  // namespace

struct Texture::State {
  State(NativeImage image, ColorConversion conversion, Wrap wrap_, std::string name_)
      : pyramid(std::move(image), std::move(conversion)), wrap(wrap_), name(std::move(name_)) {
    system->attribute("max_memory_MB", 1024.0f);
    const OIIO::ustring file("picture");  // Each texture has its own cache, so that the name need not be unique.
    const ImagePyramid* const pointer = &pyramid;
    OIIO::ImageSpec config;
    config.attribute(pyramid_attribute, OIIO::TypeDesc::PTR, &pointer);
    const auto create = []() -> OIIO::ImageInput* { return new PyramidInput; };
    if (!system->imagecache()->add_file(file, create, &config)) fail();
    handle = system->get_texture_handle(file);
    if (!system->good(handle)) fail();
  }

  [[noreturn]] void fail() const {
    throw std::runtime_error("cannot look up " + name + ": " + one_line(system->geterror()));
  }

  Vector4f sample(OIIO::TextureSystem::Perthread* thread, OIIO::TextureOpt& options, int level,
                  const Vector2d& st) const;
  Vector4f mean(const Vector2d& st) const;
  Vector4f probe(OIIO::TextureSystem::Perthread* thread, const Vector2d& st, LevelChoice choice) const;

  ImagePyramid pyramid;
  Wrap wrap;
  std::string name;  ///< For error messages.
  OIIO::TextureOpt options = make_options(wrap);
  TextureSystemPtr system{OIIO::TextureSystem::create(false)};
  OIIO::TextureSystem::TextureHandle* handle = nullptr;
};

/// @param st  In OpenImageIO's coordinates: t goes from the top downwards.
Vector4f Texture::State::sample(OIIO::TextureSystem::Perthread* thread, OIIO::TextureOpt& level_options, int level,
                                const Vector2d& st) const {
  level_options.subimage = level;
  alignas(16) float rgba[4];
  if (!system->texture(handle, thread, level_options, static_cast<float>(st.x()), static_cast<float>(st.y()), 0, 0, 0,
                       0, 4, rgba))
    fail();
  return Eigen::Map<const Vector4f>(rgba);
}

Vector4f Texture::State::probe(OIIO::TextureSystem::Perthread* thread, const Vector2d& st, LevelChoice choice) const {
  const Vector2d place(bring_near(st.x(), wrap), bring_near(1 - st.y(), wrap));
  OIIO::TextureOpt level_options = options;
  if (choice.level == 0 && choice.blend == 0 && is_centre(place.x(), pyramid.width(0)) &&
      is_centre(place.y(), pyramid.height(0)))
    level_options.interpmode = OIIO::TextureOpt::InterpClosest;
  Vector4f result = sample(thread, level_options, choice.level, place);
  if (choice.blend > 0) result += choice.blend * (sample(thread, level_options, choice.level + 1, place) - result);
  return result;
}

Texture::Texture(Image image, Wrap wrap)
    : state_(std::make_unique<State>(native_image(std::move(image)), ColorConversion(), wrap, "a picture in memory")) {}

Texture::Texture(const std::filesystem::path& file, const ColorManagement& color, const std::string& color_space,
                 Wrap wrap) {
  NativeImage image = read_native_image(file);
  const bool integer = image.type != SampleType::float32;
  ColorConversion conversion = color.to_working(color.texture_space(file, integer, color_space));
  state_ = std::make_unique<State>(std::move(image), std::move(conversion), wrap, file.string());
}

Texture::~Texture() = default;
Texture::Texture(Texture&&) noexcept = default;
Texture& Texture::operator=(Texture&&) noexcept = default;

int Texture::width() const { return state_->pyramid.width(0); }
int Texture::height() const { return state_->pyramid.height(0); }

/// The mean of the picture, or transparent black outside a picture that does not continue beyond its edges.
Vector4f Texture::State::mean(const Vector2d& st) const {
  const bool outside = (st.array() < 0).any() || (st.array() > 1).any();
  return outside && wrap == Wrap::none ? Vector4f::Zero() : pyramid.mean();
}

/// Probes lie along the longer axis, at distances of at most the length of the shorter axis. Each probe is a bilinear
/// tent in the level whose texels are as large as the shorter axis. Together the probes form a box as long as the
/// longer axis.
Vector4f Texture::lookup(const Vector2d& st, const Matrix2d& footprint) const {
  if (!st.allFinite()) return Vector4f::Zero();
  if (!is_resolved(footprint)) return state_->mean(st);
  const Vector2d size(width(), height());
  const Ellipse ellipse = limit(make_ellipse(size.asDiagonal() * footprint), size.maxCoeff());
  if (ellipse.minor >= size.maxCoeff()) return state_->mean(st);
  const LevelChoice choice = choose_level(ellipse.minor, state_->pyramid.levels());
  const int probes = std::max(1, static_cast<int>(std::ceil(ellipse.major / ellipse.minor - 1e-3)));
  const Vector2d line = (ellipse.major - ellipse.minor) * ellipse.direction.cwiseQuotient(size);
  OIIO::TextureSystem::Perthread* const thread = state_->system->get_perthread_info();
  Vector4f sum = Vector4f::Zero();
  for (int i = 0; i < probes; ++i) sum += state_->probe(thread, st + ((i + 0.5) / probes - 0.5) * line, choice);
  return sum / static_cast<float>(probes);
}

}  // namespace tensorray
