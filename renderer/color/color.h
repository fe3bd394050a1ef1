#pragma once
/// @file renderer/color/color.h
/// From CIE XYZ to the scene-linear working space, and from there to a display, through OpenColorIO.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "renderer/images/image.h"

namespace tensorray {

/// From linear Rec.709 (ITU-R BT.709, white D65) to XYZ, with the white at Y = 1.
Eigen::Matrix3d rec709_to_xyz();

struct ColorSettings {
  std::filesystem::path config;  ///< An OCIO config; empty: $OCIO, and without it the built-in config.
  std::string display;           ///< Empty: the config's default display.
  std::string view;              ///< Empty: the display's default view.
};

/// Turns colours into the working space, in place: `count` pixels of R, G, B, A, the alpha not multiplied in, and left
/// alone. Any thread may call it. Empty where the colours are in the working space already.
using ColorConversion = std::function<void(float* rgba, std::size_t count)>;

/// An OpenColorIO config with one display and view chosen. Immutable; any number of threads may use it.
class ColorManagement {
 public:
  /// @throw std::runtime_error naming the config and the mend: unreadable, not valid, no scene_linear role or not a
  /// linear one, unknown display or view (the message lists the known ones).
  explicit ColorManagement(const ColorSettings& settings);
  ~ColorManagement();
  ColorManagement(ColorManagement&&) noexcept;
  ColorManagement& operator=(ColorManagement&&) noexcept;

  /// The 3x3 matrix from XYZ to the working space (role `scene_linear`). The XYZ of the D65 white (Y = 1) and the
  /// working space's white (1, 1, 1) are the same: XYZ is taken as relative to D65. The working space is found through
  /// the config's role `aces_interchange` or `cie_xyz_d65_interchange`; where a config has neither, scene_linear is
  /// taken to have the primaries of Rec.709.
  Eigen::Matrix3d xyz_to_working() const;

  /// The same, with `white` (XYZ, Y > 0) adapted to D65 first (Bradford), so that it becomes neutral. A white so
  /// saturated that one of its cone responses is below 1 % of D65's (most monochromatic lights) leaves no colour to
  /// adapt: everything then becomes neutral, with its own Y.
  /// @throw std::invalid_argument unless Y > 0.
  Eigen::Matrix3d xyz_to_working_adapted(const Eigen::Vector3d& white) const;

  /// Applies the display and view to a scene-linear picture with channels R, G, B first, in place. Alpha and other
  /// channels are left alone. Values outside what the display shows are clipped by the writer, not here. Runs on all
  /// threads.
  /// @throw std::invalid_argument if the picture does not begin with R, G, B.
  void to_display(Image& image) const;

  /// The colour space of a picture's file: `wanted` (a name, an alias or a role) if it is not empty. Else what the file
  /// rules of the user's config say, unless only the default rule fits; else scene_linear for floats, and for integers
  /// the piecewise sRGB curve on Rec.709 primaries under one of the names that configs give it.
  /// @throw std::runtime_error if the config has no such space; the message lists those that it has.
  std::string texture_space(const std::filesystem::path& file, bool integer, const std::string& wanted) const;

  /// The way from a colour space of the config to the working space: exact to single precision where the config's
  /// transforms are formulas. It may outlive this object.
  /// @throw std::runtime_error naming the space if the config cannot convert it.
  ColorConversion to_working(const std::string& space) const;

  std::string config_name() const;    ///< For provenance: the path of the config, or "built-in".
  std::string working_space() const;  ///< The name of the scene_linear space.
  std::string display() const;
  std::string view() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tensorray
