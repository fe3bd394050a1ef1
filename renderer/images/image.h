#pragma once
/// @file renderer/images/image.h
/// A picture in memory, and the one place where pictures are written (OpenImageIO).

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
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

/// Whether files with the ending of `path` hold an alpha: then as it is, not multiplied into the colours (EXR: it is).
bool holds_alpha(const std::filesystem::path& path);

/// Text that is written into a picture's header, by attribute name.
using ImageMetadata = std::map<std::string, std::string>;

/// The endings that `write_image` knows: .exr .png .jpg .jpeg .tif .tiff (in any case).
std::vector<std::string> image_endings();

/// How many threads writing and reading of pictures may use, from now on: all until this is called. OpenEXR compresses
/// strips of a picture at once. Not while pictures are written or read.
void set_image_threads(int threads);

/// Writes a picture; the ending of `path` chooses the format. The same picture gives the same bytes at any time.
/// - EXR: all channels as 32-bit floats, ZIP-compressed, values and names as they are; all metadata.
/// - PNG: 16 bits, all metadata. TIFF: 16 bits. JPEG: 8 bits, quality 95. TIFF and JPEG hold no metadata but
///   ImageDescription, Software, Artist and Copyright.
/// Values of all but EXR are taken as display-referred and clipped to [0, 1] (not a number: 0); PNG and JPEG are marked
/// as sRGB, unless the metadata `oiio:ColorSpace` says otherwise. They hold the first three channels, or the first
/// alone if there are fewer than three; PNG and TIFF also a fourth one if it is "A": as it is, not multiplied into nor
/// divided out of the others. The file is encoded in memory and then written in place: use an OutputFile
/// (base/output_file.h) to never leave half of one.
/// @throw std::invalid_argument if the picture has no pixels or not as many as its size and channels say.
/// @throw std::runtime_error naming the file and the reason (also when the disk is full).
void write_image(const std::filesystem::path& path, const Image& image, const ImageMetadata& metadata = {});

/// Reads a picture as floats, values as they are in the file (integers from 0 to 1): colours are not converted, and
/// alpha is not multiplied in. Of several pictures in one file, the first.
/// @throw std::runtime_error naming the file and the reason; a file that was cut off is refused.
Image read_image(const std::filesystem::path& path);

/// How a picture's values are stored.
enum class SampleType { uint8, uint16, float32 };

/// A picture as it is in its file, for pictures too large to be held as floats.
struct NativeImage {
  int width = 0;  ///< Of the whole picture (the display window).
  int height = 0;
  int data_x = 0;  ///< Where the stored pixels begin, from the picture's upper left corner (the data window).
  int data_y = 0;
  int data_width = 0;
  int data_height = 0;
  SampleType type = SampleType::float32;
  int channels = 0;                     ///< Stored for each pixel, interleaved.
  std::array<int, 3> rgb{};             ///< Which of them are red, green and blue; of a grey picture, the same one.
  int alpha = -1;                       ///< Which one is alpha; -1: none.
  bool is_premultiplied = false;        ///< Whether the colours are multiplied by alpha.
  std::shared_ptr<const void> samples;  ///< data_width * data_height * channels values, rows from the top.
};

/// Reads a picture as it is in its file: integers of up to 8 bits and up to 16 bits, everything else as floats. The
/// channels are found by their names: R, G, B (without a layer's name, or else of the first layer that has them), Y or
/// a single channel of any name for grey, and A.
/// @throw std::runtime_error naming the file and the reason; a file that was cut off, that has no such channels, or
/// whose values take more than 8 GiB is refused.
NativeImage read_native_image(const std::filesystem::path& path);

/// The same in memory, without a copy. @throw std::invalid_argument unless the channels are R, G, B or R, G, B, A (with
/// the alpha multiplied in) and all pixels are there.
NativeImage native_image(Image image);

/// Writes R, G, B, A of `count` pixels, from (x, y) to the right, all within the picture. Integers become 0 to 1; alpha
/// is 1 where the picture has none; all four are 0 where no pixels are stored; values that are not finite are 0.
void read_pixels(const NativeImage& image, int x, int y, int count, float* rgba);

}  // namespace tensorray
