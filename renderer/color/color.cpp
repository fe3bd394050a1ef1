#include "renderer/color/color.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>

#include <Eigen/LU>
#include <OpenColorIO/OpenColorIO.h>
#include <tbb/parallel_for.h>

#include "base/errors.h"
#include "base/text/text.h"
#include "renderer/color/chromaticities.h"
#include "renderer/color/file_colors.h"

namespace OCIO = OCIO_NAMESPACE;

namespace tensorray {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d white_d65() { return xyz_of(d65_white()); }

/// From ACES2065-1 (SMPTE ST 2065-1) to XYZ. The blue primary has a negative y.
Matrix3d aces_to_xyz() { return rgb_to_xyz({{0.7347, 0.2653}, {0, 1}, {0.0001, -0.0770}, aces_white()}); }

struct NamedConfig {
  OCIO::ConstConfigRcPtr config;
  std::string name;
};

void require_config_readable(const std::string& name, const std::string& fix) {
  try {
    require_readable(name);
  } catch (const std::exception& error) {
    throw std::runtime_error("OCIO config " + name + ": " + error.what() + fix);
  }
}

/// What to do about a config that this version of the library cannot read.
std::string way_out(bool is_file) {
  const std::string version = std::string("OpenColorIO ") + OCIO::GetVersion();
  if (!is_file)
    return OCIO::GetVersionHex() >= 0x02020000
               ? ""
               : "; " + version + " has no configs of its own (2.2 has); name a file, or \"built-in\"";
  return "; if it is for a newer library than " + version +
         ", take a version of the config for an older one, or \"built-in\"";
}

/// @param fix  More for the message.
NamedConfig open_config(const std::string& name, const std::string& fix) {
  const bool is_file = !is_library_config(name);
  if (is_file) require_config_readable(name, fix);
  try {
    return {OCIO::Config::CreateFromFile(name.c_str()), name};
  } catch (const std::exception& error) {
    throw std::runtime_error("OCIO config " + name + ": " + one_line(error.what()) + way_out(is_file) + fix);
  }
}

NamedConfig find_config(const std::string& name) {
  const char* const environment = std::getenv("OCIO");
  if (!name.empty() && name != builtin_config_word) return open_config(name, "");
  if (name.empty() && environment && *environment)
    return open_config(environment, "; correct or unset $OCIO (without it the built-in config is used)");
  std::istringstream text(builtin_color_config);
  return {OCIO::Config::CreateFromStream(text), builtin_config_word};
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

std::vector<std::string> displays_in(const OCIO::Config& config) {
  std::vector<std::string> names;
  for (int i = 0; i < config.getNumDisplays(); ++i) names.emplace_back(config.getDisplay(i));
  return names;
}

std::vector<std::string> views_in(const OCIO::Config& config, const std::string& display) {
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
           adaptation(white_d65(), xyz_of(aces_white())).value();
  if (config.hasRole("cie_xyz_d65_interchange")) return matrix_to_working(config, "cie_xyz_d65_interchange");
  return rec709_to_xyz().inverse();
}

/// Characters that ICC profiles of version 2 can hold.
std::string printable_ascii(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return text;
}

/// The mark of files for a display, if its colours are a curve and a matrix. @param to_xyz  From the display's values.
DisplayEncoding measured_encoding(const OCIO::CPUProcessor& to_xyz, const std::string& name) {
  constexpr double rounding = 2e-3;
  constexpr int last = 4095;
  const double white = apply(to_xyz, Vector3d::Ones()).y();
  if (!(std::abs(white - 1) < 0.01)) return {};  // Displays of high dynamic range.
  const auto light_of = [&](const Vector3d& values) { return Vector3d(apply(to_xyz, values) / white); };
  Matrix3d rgb_to_xyz_matrix;
  for (int c = 0; c < 3; ++c) rgb_to_xyz_matrix.col(c) = light_of(Vector3d::Unit(c));
  std::vector<float> curve;
  double from_srgb = (rgb_to_xyz_matrix - rec709_to_xyz()).cwiseAbs().maxCoeff();
  for (int i = 0; i <= last; ++i) {
    const double value = static_cast<double>(i) / last;
    curve.push_back(static_cast<float>(light_of(Vector3d::Constant(value)).y()));
    from_srgb = std::max(from_srgb, std::abs(static_cast<double>(curve.back()) - srgb_light(value)));
  }
  for (const Eigen::Vector3i& place : {Eigen::Vector3i(800, 2000, 3700), {3700, 400, 1600}, {2000, 2000, 2000}}) {
    const Vector3d light(curve[place[0]], curve[place[1]], curve[place[2]]);
    const Vector3d differs = light_of(place.cast<double>() / last) - rgb_to_xyz_matrix * light;
    if (!(differs.cwiseAbs().maxCoeff() < rounding)) return {};
  }
  if (from_srgb < rounding) return {true, ""};
  return {false, make_icc_profile(name, named_chromaticities(rgb_to_xyz_matrix), curve)};
}

/// What a view of a display shows its pictures in. Configs of version 1 do not say what their displays are; only names
/// tell. @throw OCIO::Exception if a conversion has no inverse.
DisplayEncoding stated_encoding(const OCIO::Config& config, const std::string& display, const std::string& view) {
  const std::string name = config.getDisplayViewColorSpaceName(display.c_str(), view.c_str());
  const std::string space_name = name == "<USE_DISPLAY_NAME>" ? display : name;
  const OCIO::ConstColorSpaceRcPtr space = config.getColorSpace(space_name.c_str());
  if (!space || space->isData()) return {};
  if (space->getReferenceSpaceType() != OCIO::REFERENCE_SPACE_DISPLAY)
    return {lower_case(space_name).find("srgb") != std::string::npos, ""};
  if (!config.hasRole("cie_xyz_d65_interchange")) return {};
  const auto to_xyz = config.getProcessor(space_name.c_str(), "cie_xyz_d65_interchange")->getDefaultCPUProcessor();
  return measured_encoding(*to_xyz, printable_ascii(space_name));
}

/// The same, if that can be known: a display of which it cannot still shows pictures.
DisplayEncoding encoding_of(const OCIO::Config& config, const std::string& display, const std::string& view) {
  try {
    return stated_encoding(config, display, view);
  } catch (const OCIO::Exception&) {
    return {};
  }
}

}  // namespace

const char* const builtin_color_config =
#include "renderer/color/builtin_config.inc"
    ;

const char* const builtin_config_word = "built-in";

const char* const soft_highlights_view = "Soft highlights";

bool is_library_config(const std::string& name) { return name == builtin_config_word || starts_with(name, "ocio://"); }

Matrix3d rec709_to_xyz() { return rgb_to_xyz(rec709_chromaticities()); }

struct ColorManagement::State {
  OCIO::ConstConfigRcPtr config;
  std::string config_name, working_space, display, view;
  OCIO::ConstCPUProcessorRcPtr to_display;
  DisplayEncoding encoding;
  Matrix3d xyz_to_working;
};

ColorManagement::ColorManagement(const ColorSettings& settings) : state_(std::make_shared<State>()) {
  OCIO::SetLoggingFunction([](const char*) {});  // Messages that matter also come as exceptions.
  const auto [config, name] = find_config(settings.config);
  const std::string subject = "OCIO config " + name;
  try {
    config->validate();
    if (!config->hasRole(OCIO::ROLE_SCENE_LINEAR))
      throw std::runtime_error("no role scene_linear; give it to the config's linear working space");
    state_->working_space = config->getColorSpace(OCIO::ROLE_SCENE_LINEAR)->getName();
    state_->display =
        choose(settings.display, config->getDefaultDisplay(), displays_in(*config), "the list of displays");
    const std::vector<std::string> known = views_in(*config, state_->display);
    state_->view = choose(settings.view, config->getDefaultView(state_->display.c_str()), known,
                          "display " + in_quotes(state_->display));
    state_->to_display = display_processor(*config, state_->display, state_->view);
    state_->encoding = encoding_of(*config, state_->display, state_->view);
    state_->xyz_to_working = find_xyz_to_working(*config);
  } catch (const std::exception& error) {
    throw std::runtime_error(subject + ": " + one_line(error.what()));
  }
  state_->config = config;
  state_->config_name = name;
}

Matrix3d ColorManagement::xyz_to_working() const { return state_->xyz_to_working; }

Matrix3d ColorManagement::xyz_to_working_adapted(const Vector3d& white) const {
  if (!(white.y() > 0 && white.allFinite()))
    throw std::invalid_argument("the white to adapt to must be finite and have Y > 0");
  const std::optional<Matrix3d> adapted = adaptation(white / white.y(), white_d65());
  if (!adapted) return state_->xyz_to_working * white_d65() * Vector3d::UnitY().transpose();
  return state_->xyz_to_working * *adapted;
}

void ColorManagement::to_display(Image& image) const {
  if (!begins_with_rgb(image))
    throw std::invalid_argument("a picture for a display must begin with the channels R, G, B");
  const std::ptrdiff_t pixel_bytes = static_cast<std::ptrdiff_t>(image.channels.size() * sizeof(float));
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

ColorConversion ColorManagement::picture_conversion(const std::filesystem::path& file, const NativeImage& image,
                                                    const std::string& wanted, std::vector<std::string>& notes) const {
  const auto by_name = [&] { return to_working(texture_space(file, image.is_integer, wanted)); };
  if (!wanted.empty() || !space_by_rule(*state_->config, file).empty()) return by_name();
  try {
    const bool grey = image.rgb[0] == image.rgb[1];
    const auto conversion = file_colors(image.tags, image.is_integer, grey, state_->xyz_to_working);
    return conversion ? *conversion : by_name();
  } catch (const std::runtime_error& error) {
    notes.push_back("warning: " + file.string() + ": its description of its colours is not used: " + error.what());
    return by_name();
  }
}

const DisplayEncoding& ColorManagement::display_encoding() const { return state_->encoding; }

std::array<double, 8> ColorManagement::working_chromaticities() const {
  return numbers_of(named_chromaticities(state_->xyz_to_working.inverse()));
}

std::string ColorManagement::config_name() const { return state_->config_name; }
std::string ColorManagement::working_space() const { return state_->working_space; }
std::string ColorManagement::display() const { return state_->display; }
std::string ColorManagement::view() const { return state_->view; }
std::vector<std::string> ColorManagement::displays() const { return displays_in(*state_->config); }
std::vector<std::string> ColorManagement::views() const { return views_in(*state_->config, state_->display); }

}  // namespace tensorray
