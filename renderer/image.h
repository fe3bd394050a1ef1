#pragma once
/// @file renderer/image.h
/// A picture in memory, and the one place where pictures are written (OpenImageIO).

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace tensorray {

/// Pixels as 32-bit floats, row by row from the top, channels interleaved.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< Names: "R", "G", "B", "A", "Z", "S0.550,000000nm" ...
  std::vector<float> pixels;          ///< width * height * channels.size()

  Image() = default;
  Image(int width_, int height_, std::vector<std::string> channels_)
      : width(width_),
        height(height_),
        channels(std::move(channels_)),
        pixels(static_cast<std::size_t>(width_) * height_ * channels.size()) {}

  float* pixel(int x, int y) { return &pixels[(static_cast<std::size_t>(y) * width + x) * channels.size()]; }
  const float* pixel(int x, int y) const {
    return &pixels[(static_cast<std::size_t>(y) * width + x) * channels.size()];
  }
};

/// Text that is written into a picture's header, by attribute name.
using ImageMetadata = std::map<std::string, std::string>;

/// The endings that `write_image` knows: .exr .png .jpg .jpeg .tif .tiff (in any case).
std::vector<std::string> image_endings();

/// Writes a picture; the ending of `path` chooses the format. The same picture gives the same bytes at any time.
/// - EXR: all channels as 32-bit floats, ZIP-compressed, values and names as they are; all metadata.
/// - PNG: 16 bits, all metadata. TIFF: 16 bits. JPEG: 8 bits, quality 95. TIFF and JPEG hold no metadata but
///   ImageDescription, Software, Artist and Copyright.
/// Values of all but EXR are taken as display-referred and clipped to [0, 1] (not a number: 0); PNG and JPEG are marked
/// as sRGB, unless the metadata `oiio:ColorSpace` says otherwise. They hold the first three channels, or the first
/// alone if there are fewer than three; PNG and TIFF also a fourth one if it is "A": as it is, not multiplied into nor
/// divided out of the others. The file is encoded in memory and then written in place: use an OutputFile
/// (scenes/output_file.h) to never leave half of one.
/// @throw std::invalid_argument if the picture has no pixels or not as many as its size and channels say.
/// @throw std::runtime_error naming the file and the reason (also when the disk is full).
void write_image(const std::filesystem::path& path, const Image& image, const ImageMetadata& metadata = {});

/// Reads a picture as floats, values as they are in the file (integers from 0 to 1): colours are not converted, and
/// alpha is not multiplied in. Of several pictures in one file, the first.
/// @throw std::runtime_error naming the file and the reason; a file that was cut off is refused.
Image read_image(const std::filesystem::path& path);

}  // namespace tensorray
