#pragma once
/// @file renderer/textures/texture.h
/// A picture that is looked up with a filter as large as what a pixel sees of it.

#include <filesystem>
#include <memory>
#include <string>

#include <Eigen/Core>

#include "renderer/color/color.h"
#include "renderer/images/image.h"

namespace tensorray {

/// How a picture continues beyond its edges.
enum class Wrap {
  none,    ///< Nothing there: transparent black.
  clamp,   ///< The edge's colour goes on.
  repeat,  ///< Tiles.
  mirror,  ///< Tiles, every other one mirrored.
};

/// A picture in the scene-linear working space, filtered by OpenImageIO's TextureSystem over MIP maps.
///
/// Coordinates are those of ST maps: (0, 0) is the lower left corner of the picture, (1, 1) the upper right one;
/// of a picture of W pixels, pixel x has its centre at s = (x + ½) / W. Values that are not finite count as 0.
/// Memory: the picture as it is in its file, and a cache of at most about 1 GiB of filtered tiles.
/// Threads: any number may look up at once.
class Texture {
 public:
  /// @param image  Scene-linear, working space; channels R, G, B, or R, G, B, A with the alpha multiplied in.
  /// @throw std::invalid_argument unless these are its channels, in this order, and it has pixels.
  Texture(Image image, Wrap wrap);

  /// Reads a file in any format that OpenImageIO knows: integers of 8 or 16 bits, floats; grey, grey with alpha, RGB,
  /// RGBA, CMYK (converted by its reader). The picture is the file's display window, transparent black where that lies
  /// outside the data window.
  /// @param color_space  Of the file: a name, alias or role of the OCIO config; empty: see
  ///                     `ColorManagement::texture_space`. A file's alpha stays as it is.
  /// @throw std::runtime_error naming the file and the mend: missing, empty, cut off, not a picture, without colour
  /// channels, too large for the memory.
  Texture(const std::filesystem::path& file, const ColorManagement& color, const std::string& color_space, Wrap wrap);

  ~Texture();
  Texture(Texture&&) noexcept;
  Texture& operator=(Texture&&) noexcept;

  int width() const;
  int height() const;

  /// The picture's mean over a footprint: R, G, B with alpha multiplied in, and alpha.
  /// @param st         Where. Where it is not finite, there is transparent black.
  /// @param footprint  Columns: by how much (s, t) changes from one pixel to the next, along x and along y. Texels
  ///                   larger than it are interpolated linearly (sharp), smaller ones averaged (no moiré). With the
  ///                   footprint of one texel, a look-up at a texel's centre is that texel. A footprint that is not
  ///                   finite, or larger than the picture, gives the mean of the picture; with `Wrap::none` only if
  ///                   `st` is in [0, 1]², and transparent black outside.
  Eigen::Vector4f lookup(const Eigen::Vector2d& st, const Eigen::Matrix2d& footprint) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tensorray
