#include "renderer/color/color.h"

#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <vector>

#include <Eigen/LU>
#include <OpenColorIO/OpenColorIO.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/text.h"
#include "renderer/color/builtin_config.h"

namespace OCIO = OCIO_NAMESPACE;

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Converts a chromaticity to XYZ with Y = 1.
Vector3d from_chromaticity(double x, double y) { return {x / y, 1, (1 - x - y) / y}; }

const Vector3d white_d65 = from_chromaticity(0.3127, 0.3290);
const Vector3d white_aces = from_chromaticity(0.32168, 0.33767);

/// The matrix from linear RGB to XYZ. Columns of `primaries`: XYZ of the primaries; `white`: XYZ of RGB (1, 1, 1).
Matrix3d rgb_to_xyz(const Matrix3d& primaries, const Vector3d& white) {
  return primaries * (primaries.inverse() * white).asDiagonal();
}

/// From ACES2065-1 (SMPTE ST 2065-1) to XYZ. The blue primary has a negative y.
Matrix3d aces_to_xyz() {
  Matrix3d primaries;
  primaries << from_chromaticity(0.7347, 0.2653), from_chromaticity(0, 1), from_chromaticity(0.0001, -0.0770);
  return rgb_to_xyz(primaries, white_aces);
}

Matrix3d bradford_cones() {
  Matrix3d cones;
  cones << 0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296;
  return cones;
}

/// Bradford's chromatic adaptation from one white to another (XYZ, Y = 1). Empty if `from` is too saturated for it.
std::optional<Matrix3d> adaptation(const Vector3d& from, const Vector3d& to) {
  constexpr double least_response = 0.01;
  const Matrix3d cones = bradford_cones();
  const Vector3d response = (cones * from).cwiseQuotient(cones * to);
  if (!(response.minCoeff() > least_response)) return std::nullopt;
  return cones.inverse() * response.cwiseInverse().asDiagonal() * cones;
}

/// A config and its name for messages and provenance.
struct NamedConfig {
  OCIO::ConstConfigRcPtr config;
  std::string name;
};

NamedConfig open_config(const std::filesystem::path& path, const std::string& fix) {
  // Newer versions of OpenColorIO contain configs, which have addresses of this form.
  const bool is_file = path.string().rfind("ocio://", 0) != 0;
  try {
    if (is_file) require_readable(path);
    return {OCIO::Config::CreateFromFile(path.string().c_str()), path.string()};
  } catch (const std::exception& error) {
    throw std::runtime_error("OCIO config " + path.string() + ": " + one_line(error.what()) + fix);
  }
}

NamedConfig find_config(const std::filesystem::path& path) {
  if (!path.empty()) return open_config(path, "");
  const char* const environment = std::getenv("OCIO");
  if (environment && *environment)
    return open_config(environment, "; correct or unset $OCIO (without it the built-in config is used)");
  std::istringstream text(builtin_color_config);
  return {OCIO::Config::CreateFromStream(text), "built-in"};
}

std::string in_quotes(const std::string& text) { return "\"" + text + "\""; }

/// Returns `wanted`, or `fallback` if `wanted` is empty.
/// @throw std::runtime_error if the name is not among `known`; the message begins with `what`.
std::string choose(const std::string& wanted, const std::string& fallback, const std::vector<std::string>& known,
                   const std::string& what) {
  const std::string& name = wanted.empty() ? fallback : wanted;
  std::string list;
  for (const std::string& each : known) {
    if (each == name) return name;
    list += (list.empty() ? "" : ", ") + in_quotes(each);
  }
  throw std::runtime_error(what + " has no " + in_quotes(name) + "; known: " + (list.empty() ? "none" : list));
}

std::vector<std::string> displays(const OCIO::Config& config) {
  std::vector<std::string> names;
  for (int i = 0; i < config.getNumDisplays(); ++i) names.emplace_back(config.getDisplay(i));
  return names;
}

std::vector<std::string> views(const OCIO::Config& config, const std::string& display) {
  std::vector<std::string> names;
  for (int i = 0; i < config.getNumViews(display.c_str()); ++i) names.emplace_back(config.getView(display.c_str(), i));
  return names;
}

OCIO::ConstCPUProcessorRcPtr display_processor(const OCIO::Config& config, const std::string& display,
                                               const std::string& view) {
  const OCIO::DisplayViewTransformRcPtr transform = OCIO::DisplayViewTransform::Create();
  transform->setSrc(OCIO::ROLE_SCENE_LINEAR);
  transform->setDisplay(display.c_str());
  transform->setView(view.c_str());
  return config.getProcessor(transform)->getDefaultCPUProcessor();
}

Vector3d apply(const OCIO::CPUProcessor& processor, const Vector3d& color) {
  Eigen::Vector3f values = color.cast<float>();
  processor.applyRGB(values.data());
  return values.cast<double>();
}

std::vector<std::string> color_spaces(const OCIO::Config& config) {
  std::vector<std::string> names;
  for (int i = 0; i < config.getNumColorSpaces(); ++i) names.emplace_back(config.getColorSpaceNameByIndex(i));
  return names;
}

/// The space that the first matching file rule names. Empty if only the default rule matches.
std::string space_by_rule(const OCIO::Config& config, const std::filesystem::path& file) {
  std::size_t rule = 0;
  const std::string space = config.getColorSpaceFromFilepath(file.string().c_str(), rule);
  return rule + 1 < config.getFileRules()->getNumEntries() ? space : "";
}

/// The config's name for the colour space of ordinary picture files. Empty if it has none of the usual names.
std::string srgb_texture_space(const OCIO::Config& config) {
  for (const char* const name :
       {"texture_paint", "srgb_texture", "sRGB - Texture", "sRGB Encoded Rec.709 (sRGB)", "srgb_rec709_scene",
        "srgb_tx", "Utility - sRGB - Texture", "Input - Generic - sRGB - Texture", "sRGB"})
    if (config.getColorSpace(name)) return name;
  return "";
}

/// Finds the matrix from a space to scene_linear by converting the basis vectors.
/// @throw std::runtime_error if the conversion is not linear.
Matrix3d matrix_to_working(const OCIO::Config& config, const char* space) {
  const auto processor = config.getProcessor(space, OCIO::ROLE_SCENE_LINEAR)->getDefaultCPUProcessor();
  Matrix3d matrix;
  for (int i = 0; i < 3; ++i) matrix.col(i) = apply(*processor, Vector3d::Unit(i));
  for (const double level : {0.0, 0.18, 4.0}) {
    const Vector3d grey = Vector3d::Constant(level), expected = matrix * grey;
    if (!((apply(*processor, grey) - expected).norm() <= 1e-4 * (1 + level)))
      throw std::runtime_error("its role scene_linear is not linear light; give the role to a linear space");
  }
  return matrix;
}

/// Tries ACES first: that conversion is scene-referred, so it cannot contain a view transform.
Matrix3d find_xyz_to_working(const OCIO::Config& config) {
  if (config.hasRole("aces_interchange"))
    return matrix_to_working(config, "aces_interchange") * aces_to_xyz().inverse() *
           adaptation(white_d65, white_aces).value();
  if (config.hasRole("cie_xyz_d65_interchange")) return matrix_to_working(config, "cie_xyz_d65_interchange");
  return rec709_to_xyz().inverse();
}

}  // namespace

Matrix3d rec709_to_xyz() {
  Matrix3d primaries;
  primaries << from_chromaticity(0.64, 0.33), from_chromaticity(0.30, 0.60), from_chromaticity(0.15, 0.06);
  return rgb_to_xyz(primaries, white_d65);
}

struct ColorManagement::State {
  OCIO::ConstConfigRcPtr config;
  std::string config_name, working_space, display, view;
  OCIO::ConstCPUProcessorRcPtr to_display;
  Matrix3d xyz_to_working;
};

ColorManagement::ColorManagement(const ColorSettings& settings) : state_(std::make_unique<State>()) {
  OCIO::SetLoggingFunction([](const char*) {});  // Messages that matter also come as exceptions.
  const auto [config, name] = find_config(settings.config);
  const std::string subject = "OCIO config " + name;
  try {
    config->validate();
    if (!config->hasRole(OCIO::ROLE_SCENE_LINEAR))
      throw std::runtime_error("no role scene_linear; give it to the config's linear working space");
    state_->working_space = config->getColorSpace(OCIO::ROLE_SCENE_LINEAR)->getName();
    state_->display = choose(settings.display, config->getDefaultDisplay(), displays(*config), "the list of displays");
    state_->view = choose(settings.view, config->getDefaultView(state_->display.c_str()),
                          views(*config, state_->display), "display " + in_quotes(state_->display));
    state_->to_display = display_processor(*config, state_->display, state_->view);
    state_->xyz_to_working = find_xyz_to_working(*config);
  } catch (const std::exception& error) {
    throw std::runtime_error(subject + ": " + one_line(error.what()));
  }
  state_->config = config;
  state_->config_name = name;
}

ColorManagement::~ColorManagement() = default;
ColorManagement::ColorManagement(ColorManagement&&) noexcept = default;
ColorManagement& ColorManagement::operator=(ColorManagement&&) noexcept = default;

Matrix3d ColorManagement::xyz_to_working() const { return state_->xyz_to_working; }

Matrix3d ColorManagement::xyz_to_working_adapted(const Vector3d& white) const {
  if (!(white.y() > 0 && white.allFinite()))
    throw std::invalid_argument("the white to adapt to must be finite and have Y > 0");
  const std::optional<Matrix3d> adapted = adaptation(white / white.y(), white_d65);
  if (!adapted) return state_->xyz_to_working * white_d65 * Vector3d::UnitY().transpose();
  return state_->xyz_to_working * *adapted;
}

void ColorManagement::to_display(Image& image) const {
  const std::vector<std::string>& channels = image.channels;
  if (channels.size() < 3 || channels[0] != "R" || channels[1] != "G" || channels[2] != "B")
    throw std::invalid_argument("a picture for a display must begin with the channels R, G, B");
  const std::ptrdiff_t pixel_bytes = static_cast<std::ptrdiff_t>(channels.size() * sizeof(float));
  tbb::parallel_for(0, image.height, [&](int y) {
    OCIO::PackedImageDesc row(image.pixel(0, y), image.width, 1, 3, OCIO::BIT_DEPTH_F32, sizeof(float), pixel_bytes,
                              pixel_bytes * image.width);
    state_->to_display->apply(row);
  });
}

std::string ColorManagement::texture_space(const std::filesystem::path& file, bool integer,
                                           const std::string& wanted) const {
  const OCIO::Config& config = *state_->config;
  if (!wanted.empty())
    return config.getColorSpace(wanted.c_str())
               ? wanted
               : choose(wanted, "", color_spaces(config), "OCIO config " + state_->config_name);
  const std::string by_rule = space_by_rule(config, file);
  if (!by_rule.empty()) return by_rule;
  if (!integer) return OCIO::ROLE_SCENE_LINEAR;
  const std::string srgb = srgb_texture_space(config);
  if (srgb.empty())
    throw std::runtime_error("OCIO config " + state_->config_name + " has no colour space for sRGB pictures such as " +
                             file.string() + "; name theirs by `integrator.image_color_space`");
  return srgb;
}

ColorConversion ColorManagement::to_working(const std::string& space) const {
  // Faster settings approximate powers and logarithms, and invert tables inexactly.
  constexpr OCIO::OptimizationFlags exact = OCIO::OPTIMIZATION_LOSSLESS;
  try {
    const auto processor = state_->config->getProcessor(space.c_str(), OCIO::ROLE_SCENE_LINEAR);
    const OCIO::ConstCPUProcessorRcPtr cpu = processor->getOptimizedCPUProcessor(exact);
    if (cpu->isNoOp()) return {};
    return [cpu](float* rgba, std::size_t count) {
      // Convert three channels: with four, curves would also pass alpha through, with a rounding error.
      const std::ptrdiff_t pixel_bytes = 4 * sizeof(float),
                           row_bytes = pixel_bytes * static_cast<std::ptrdiff_t>(count);
      OCIO::PackedImageDesc pixels(rgba, static_cast<long>(count), 1, 3, OCIO::BIT_DEPTH_F32, sizeof(float),
                                   pixel_bytes, row_bytes);
      cpu->apply(pixels);
    };
  } catch (const std::exception& error) {
    throw std::runtime_error("OCIO config " + state_->config_name + " cannot convert " + in_quotes(space) +
                             " to scene_linear: " + one_line(error.what()));
  }
}

std::string ColorManagement::config_name() const { return state_->config_name; }
std::string ColorManagement::working_space() const { return state_->working_space; }
std::string ColorManagement::display() const { return state_->display; }
std::string ColorManagement::view() const { return state_->view; }

}  // namespace tensorray
