#pragma once
/// How picture files are encoded and decoded, for image.h. Errors are std::runtime_error without the file's name.

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "renderer/images/image.h"

namespace tensorray {

// EXR and PNG are written without OpenImageIO, which takes longer to load than a small render takes.

/// An EXR of rows with all channels as 32-bit floats (but half colours), ZIP-compressed. The file has the channels in
/// alphabetical order. Any number of threads may call it at once, with the same `threads`.
/// @param image     At least one pixel and one channel; any values. Names of channels that are empty, or equal in their
///                  first 255 characters (the format's limit), become "channel" and the channel's number.
/// @param metadata  All becomes text, with ImageDescription as `comments` and Copyright as `owner`; names that mean
///                  something else in the format (`channels` ...) are left out, and so is `oiio:ColorSpace`.
/// @param threads   How many compress at once; 0: all. They are OpenEXR's own, of which a process has one pool.
std::vector<unsigned char> encode_exr(const Image& image, const ImageMetadata& metadata, int threads);

/// A PNG of 8 or 16 bits, marked as sRGB unless the metadata `oiio:ColorSpace` says otherwise.
/// @param image     One channel (grey), three (RGB) or four (RGBA, colours not multiplied by alpha); values in [0, 1].
/// @param metadata  All becomes text; names longer than 79 characters are left out: the format has no place for them.
std::vector<unsigned char> encode_png(const Image& image, const ImageMetadata& metadata, int bits = 16);

/// cICP, sRGB, gAMA and cHRM of a PNG, without those that are damaged; nothing if the file is no PNG. OpenImageIO 2.4
/// does not pass on chromaticities and code points, and libpng prints a line of its own about damaged files.
/// @throw std::runtime_error: it is cut off, or a chunk that pictures need has another CRC.
std::optional<ColorTags> read_png_chunks(const std::filesystem::path& path);

/// An EXR that is stored as luminance and two colour differences, at half of the resolution, as R, G, B, A. OpenImageIO
/// does not read them. Nothing if the file is no such picture.
std::optional<NativeImage> read_luminance_chroma(const std::filesystem::path& path);

/// How a file format stores pictures.
struct PictureFormat {
  std::string name;                       ///< OpenImageIO's name of the format chooses the writer.
  SampleType type = SampleType::float32;  ///< Of the stored values.
  bool alpha = false;
};

/// Everything that the program does with OpenImageIO (renderer/openimageio). It is a library of its own, which is
/// loaded from the folder of the program when the first picture is read, or written as JPEG or TIFF: Debian's
/// OpenImageIO brings 260 libraries, which take a quarter of a second to load, and seconds from a cold disk.
struct ImagePlugin {
  void (*set_threads)(int threads);
  /// JPEG and TIFF.
  std::vector<unsigned char> (*encode)(const Image& image, const PictureFormat& format, const ImageMetadata& metadata);
  Image (*decode)(const std::filesystem::path& path);
  NativeImage (*decode_native)(const std::filesystem::path& path, const std::string& layer);
};

inline std::size_t bytes_of(SampleType type) {
  return type == SampleType::uint8 ? 1 : type == SampleType::uint16 ? 2 : 4;
}

/// The number of bytes of a picture's values, before memory is taken for them. @throw std::runtime_error if there are
/// more than 8 GiB, or the picture has no size. Sums of sizes and places of pictures that pass are integers of 32 bits.
inline std::size_t stored_bytes(const NativeImage& image) {
  constexpr double limit = 8.0 * (1 << 30);
  constexpr int farthest = (1 << 30) - 1;
  for (const int size : {image.width, image.height, image.data_width, image.data_height})
    if (size < 1 || size > farthest) throw std::runtime_error("its header gives it no size; it may be damaged");
  for (const int place : {image.data_x, image.data_y})
    if (place < -farthest || place > farthest) throw std::runtime_error("its pixels are far outside of it");
  const double bytes = static_cast<double>(image.channels) * static_cast<double>(bytes_of(image.type));
  const double stored = bytes * image.data_width * image.data_height, whole = bytes * image.width * image.height;
  if (!(std::max(stored, whole) <= limit))
    throw std::runtime_error("its " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                             " pixels take more than 8 GiB; make it smaller");
  return static_cast<std::size_t>(stored);
}

}  // namespace tensorray
