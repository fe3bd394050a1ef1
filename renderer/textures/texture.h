#pragma once
/// A picture whose look-ups are filtered over the area that a pixel sees.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "renderer/color/color.h"
#include "renderer/images/image.h"

namespace tensorray {

/// How a picture continues beyond its edges.
enum class Wrap {
  none,    ///< Nothing: transparent black.
  clamp,   ///< The colour of the edge.
  repeat,  ///< Repeated copies.
  mirror,  ///< Repeated copies, every other one mirrored.
};

/// A picture in the scene-linear working space, filtered over MIP maps.
///
/// Coordinates are those of ST maps: (0, 0) is the lower left corner of the picture and (1, 1) the upper right one. In
/// a picture W pixels wide, the centre of pixel x is at s = (x + ½) / W. Values that are not finite count as 0.
/// Memory: 21 bytes for each pixel; of pictures of more than 16 million pixels, 5 more than their file stores for each.
/// Threads: any number may look up at the same time.
class Texture {
 public:
  /// @param image  Scene-linear, working space; channels R, G, B, or R, G, B, A with the colours multiplied by alpha.
  /// @throw std::invalid_argument if the channels are different or in another order, or if there are no pixels.
  Texture(Image image, Wrap wrap);

  /// Reads a file in any format that OpenImageIO supports: integers of 8 or 16 bits, floats; grey, grey with alpha,
  /// RGB, RGBA, CMYK (converted by OpenImageIO's reader). The picture is the display window of the file.
  /// @param color_space  Colour space of the file: a name, alias or role of the OCIO config; empty: see
  ///                     `ColorManagement::picture_conversion`. Alpha is not converted.
  /// @param layer        Layer of the file, as of read_native_image.
  /// @param notes        Gets warnings about the file; null: nobody reads them.
  /// @throw std::runtime_error naming the file and the fix if the file is missing, empty, cut off, not a picture, has
  /// no colour channels, or is too large for the memory.
  Texture(const std::filesystem::path& file, const ColorManagement& color, const std::string& color_space, Wrap wrap,
          const std::string& layer = "", std::vector<std::string>* notes = nullptr);

  int width() const;
  int height() const;

  /// The mean of the picture over a footprint: R, G, B multiplied by alpha, and alpha.
  /// @param st         Position. If it is not finite, the result is transparent black.
  /// @param footprint  Columns: change of (s, t) from one pixel to the next, along x and along y. Texels larger than
  ///                   the footprint are interpolated linearly (sharp), smaller ones are averaged (no moiré). With the
  ///                   footprint of one texel, a look-up at the centre of a texel returns that texel. A footprint that
  ///                   is not finite, or larger than the picture, gives the mean of the picture. With `Wrap::none` it
  ///                   does so only if `st` is in [0, 1]², and gives transparent black elsewhere.
  Eigen::Vector4f lookup(const Eigen::Vector2d& st, const Eigen::Matrix2d& footprint) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace tensorray
