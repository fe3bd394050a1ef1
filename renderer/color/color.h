#pragma once
/// Conversion from CIE XYZ to the scene-linear working space, and from there to a display, by OpenColorIO.

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// The matrix from linear Rec.709 (ITU-R BT.709, white D65) to XYZ. White has Y = 1.
Eigen::Matrix3d rec709_to_xyz();

/// The config that is part of the program, as text, and its name. It refers to no other file and needs OpenColorIO 2.1.
extern const char* const builtin_color_config;
extern const char* const builtin_config_word;

/// The usual view of the built-in config: shows grey x as 1 - exp(-x) of white, and keeps spectral light in the
/// display.
extern const char* const soft_highlights_view;

/// Whether this names no file, but the built-in config, or one that OpenColorIO 2.2 or newer contains (ocio://NAME).
bool is_library_config(const std::string& name);

struct ColorSettings {
  /// An OCIO config: a file, or what is_library_config tells. Empty: $OCIO, or the built-in config if that is not set.
  std::string config;
  std::string display;  ///< A display of the config. Empty: the config's default display.
  std::string view;     ///< A view of the display. Empty: the display's default view.
};

/// Converts colours to the working space in place: `count` pixels of R, G, B, A. The colours are not multiplied by
/// alpha; alpha does not change. Any thread may call it. Empty if the colours are already in the working space.
using ColorConversion = std::function<void(float* rgba, std::size_t count)>;

/// The colours of a display, which files for it are marked with.
struct DisplayEncoding {
  bool is_srgb = false;
  std::string icc_profile;  ///< Of other displays; empty: unknown.
};

/// An OpenColorIO config with a chosen display and view. Immutable; any number of threads may use it.
class ColorManagement {
 public:
  /// @throw std::runtime_error naming the config and the fix if it is unreadable or not valid, has no scene_linear role
  /// or one that is not linear, or does not have the display or view (the message lists the known ones).
  explicit ColorManagement(const ColorSettings& settings);

  /// The 3x3 matrix from XYZ to the working space (role `scene_linear`). XYZ is relative to D65: the XYZ of the D65
  /// white (Y = 1) becomes the working space's white (1, 1, 1). The working space is found by the config's role
  /// `aces_interchange` or `cie_xyz_d65_interchange`. Without both, scene_linear has Rec.709's primaries.
  Eigen::Matrix3d xyz_to_working() const;

  /// As xyz_to_working, but adapts `white` (XYZ, Y > 0) to D65 first (Bradford), so that it becomes neutral. If one of
  /// the cone responses of the white is below 1 % of that of D65 (most monochromatic lights), adaptation is not
  /// possible: every colour then becomes neutral and keeps its Y.
  /// @throw std::invalid_argument unless Y > 0.
  Eigen::Matrix3d xyz_to_working_adapted(const Eigen::Vector3d& white) const;

  /// Applies the display and view in place to a scene-linear picture whose first channels are R, G, B. Alpha and other
  /// channels do not change. The writer clips values. Runs on all threads.
  /// @throw std::invalid_argument if the picture does not begin with R, G, B.
  void to_display(Image& image) const;

  /// The colour space of a picture file. If `wanted` (a name, an alias or a role) is not empty, it is that space.
  /// Otherwise the file rules of the user's config decide, if one other than the default rule matches. Otherwise floats
  /// are scene_linear, and integers have the piecewise sRGB curve on Rec.709 primaries, under a usual name.
  /// @throw std::runtime_error if the config does not have the space; the message lists the spaces that it has.
  std::string texture_space(const std::filesystem::path& file, bool integer, const std::string& wanted) const;

  /// The conversion from a colour space of the config to the working space: exact to single precision if the config's
  /// transforms are formulas. It may outlive this object.
  /// @throw std::runtime_error naming the space if the config cannot convert it.
  ColorConversion to_working(const std::string& space) const;

  /// The conversion of a picture file: that of texture_space if a space is wanted or a file rule matches; otherwise
  /// what the file says of its colours (file_colors.h); otherwise that of texture_space. `notes` get warnings of tags.
  ColorConversion picture_conversion(const std::filesystem::path& file, const NativeImage& image,
                                     const std::string& wanted, std::vector<std::string>& notes) const;

  const DisplayEncoding& display_encoding() const;

  /// x and y of red, green, blue and white of the working space.
  std::array<double, 8> working_chromaticities() const;

  std::string config_name() const;    ///< For provenance: the path of the config, or "built-in".
  std::string working_space() const;  ///< The name of the scene_linear space.
  std::string display() const;
  std::string view() const;
  std::vector<std::string> displays() const;  ///< All of the config.
  std::vector<std::string> views() const;     ///< All of the display.

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tensorray
