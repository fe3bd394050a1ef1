#pragma once
/// A picture in memory, and the functions that read and write files (OpenImageIO; EXR and PNG without).

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
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
  bool has_half_colors = false;       ///< An EXR has colours and normals as 16-bit floats, at most ±65504.

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

inline bool begins_with_rgb(const Image& image) {
  const std::vector<std::string>& names = image.channels;
  return names.size() >= 3 && names[0] == "R" && names[1] == "G" && names[2] == "B";
}

/// The layer of a channel: "normal" of "normal.X", "Z" of "Z"; empty: R, G, B or A of the picture itself.
std::string layer_of(const std::string& channel);

/// Whether files with the ending of `path` can store alpha. Colours are then not multiplied by it (but in EXR).
bool holds_alpha(const std::filesystem::path& path);

/// Text for a picture's header, by attribute name.
using ImageMetadata = std::map<std::string, std::string>;

/// The endings that `write_image` accepts: .exr .png .jpg .jpeg .tif .tiff (in upper or lower case).
std::vector<std::string> image_endings();

/// Sets how many threads may read and write pictures from now on; the default is all. (OpenEXR compresses strips of a
/// picture in parallel.) Do not call it while pictures are read or written.
void set_image_threads(int threads);

/// Loads what is needed to write the pictures among `files`, so that the first one does not wait for it. (EXR and PNG
/// need nothing.) Any thread may call it.
void prepare_images(const std::vector<std::filesystem::path>& files);

/// Writes a picture in the format given by the ending of `path`. The same picture always gives the same bytes.
/// - EXR: all channels as 32-bit floats unless the picture has half colours, ZIP-compressed, with unchanged values and
/// names; all metadata.
/// - PNG: 16 bits, all metadata. TIFF: 16 bits. JPEG: 8 bits, quality 95. TIFF and JPEG store only the metadata
///   ImageDescription, Software, Artist and Copyright.
/// All formats except EXR take the values as display-referred and clip them to [0, 1] (NaN: 0). PNG and JPEG are marked
/// as sRGB, unless there is metadata `oiio:ColorSpace` with another value. All three hold the profile that the metadata
/// `ICCProfile` give. In EXR, the metadata `chromaticities` (eight numbers) become the attribute. They store the first
/// three channels, or only the first if there are fewer than three. PNG and TIFF also store the fourth channel if it is
/// "A"; its values do not change, and the colours are neither multiplied nor divided by it. The file is encoded in
/// memory and then written in place: use an OutputFile (base/files/output_file.h) to never leave an incomplete file.
/// @throw std::invalid_argument if the picture has no pixels, or not as many as its size and channels require.
/// @throw std::runtime_error naming the file and the reason (also if the disk is full).
void write_image(const std::filesystem::path& path, const Image& image, const ImageMetadata& metadata = {});

/// The bytes of a PNG of 8 bits, for a browser: quickly, and without metadata. Channels and values are those of a PNG
/// of write_image. @throw std::invalid_argument as write_image.
std::vector<unsigned char> encode_for_screen(const Image& image);

/// Reads a picture as floats with the values of the file (integers are scaled to 0 to 1). Colours are not converted and
/// not multiplied by alpha. If a file has several pictures, reads the first.
/// @throw std::runtime_error naming the file and the reason; also if the file is cut off.
Image read_image(const std::filesystem::path& path);

/// What a picture file says about its colours, as it says it; renderer/color/file_colors.h says what it means.
struct ColorTags {
  std::string icc_profile;                               ///< The embedded ICC profile; empty: none.
  std::optional<std::array<double, 8>> chromaticities;   ///< x and y of red, green, blue and white.
  std::optional<std::array<double, 2>> adopted_neutral;  ///< EXR: x and y of what counts as white.
  std::optional<double> gamma;                           ///< PNG (gAMA): stored values are light to this power.
  std::optional<std::array<int, 2>> code_points;         ///< PNG (cICP): primaries and curve of ITU-T H.273.
  bool is_srgb = false;                                  ///< PNG (sRGB).
};

/// How a picture's values are stored.
enum class SampleType { uint8, uint16, float32 };

/// A picture as its file stores it, for pictures that are too large to be held as floats.
struct NativeImage {
  int width = 0;  ///< Width of the whole picture (the display window).
  int height = 0;
  int data_x = 0;  ///< Column where the stored pixels begin (the data window); 0 is the left edge of the picture.
  int data_y = 0;
  int data_width = 0;
  int data_height = 0;
  SampleType type = SampleType::float32;
  bool is_integer = false;        ///< Whether the file stores integers, also where `type` is float32.
  int channels = 0;               ///< Number of channels per pixel, interleaved.
  std::array<int, 3> rgb{};       ///< Indices of red, green and blue; all equal for a grey picture.
  int alpha = -1;                 ///< Index of alpha; -1: none.
  bool is_premultiplied = false;  ///< Whether the colours are multiplied by alpha.
  ColorTags tags;
  std::string choice;                   ///< Which part or layer was taken, if that is not evident.
  std::size_t non_finite = 0;           ///< Pixels with a value that is not finite, which counts as 0.
  std::shared_ptr<const void> samples;  ///< data_width * data_height * channels values, rows from the top.
};

/// Reads a picture as its file stores it: integers of up to 8 bits as uint8, of up to 16 bits as uint16, everything
/// else as floats. It is turned as the file's orientation says (Exif, TIFF). Channels are found by name: R, G, B
/// (without a layer's name, or else of the first layer that has them), or Nuke's red, green, blue; Y, or a single
/// channel of any name, for grey; and A. Of an EXR with several parts, the first one that has colours counts. Of EXR as
/// luminance and chroma, R, G and B are computed.
/// @param layer  Only the channels LAYER.R, ... count, the channel LAYER for grey, or the part of the file with this
///               name. Empty: any.
/// @throw std::runtime_error naming the file: it is cut off, has no such channels, or more than 8 GiB of values.
NativeImage read_native_image(const std::filesystem::path& path, const std::string& layer = "");

/// Adds to `notes` which part or layer was taken, and a warning if the picture has pixels that are not finite.
void add_notes(const std::filesystem::path& path, const NativeImage& image, std::vector<std::string>& notes);

/// Converts a picture in memory without a copy. @throw std::invalid_argument unless the channels are R, G, B or R, G,
/// B, A (with colours multiplied by alpha) and all pixels are there.
NativeImage native_image(Image image);

/// Writes R, G, B, A of `count` pixels to `rgba`, from (x, y) to the right, all within the picture. Integers are scaled
/// to 0 to 1. Alpha is 1 if the picture has none. What is not stored, or not finite, is 0.
void read_pixels(const NativeImage& image, int x, int y, int count, float* rgba);

}  // namespace tensorray
