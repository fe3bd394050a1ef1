#pragma once
/// @file renderer/images/image_plugin.h
/// Everything that the program does with OpenImageIO. It is a library of its own, which is loaded when the first
/// picture is read, or written as JPEG or TIFF: Debian's OpenImageIO brings 260 libraries, which take a
/// quarter of a second to load, and several seconds from a cold disk. Most renders do not wait for them.

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "renderer/images/image.h"

namespace tensorray {

/// How a file format stores pictures.
struct PictureFormat {
  std::string name;                       ///< OpenImageIO's name of the format chooses the writer.
  SampleType type = SampleType::float32;  ///< Of the stored values.
  bool alpha = false;
};

/// The functions of the library. Errors are std::runtime_error with one line; the caller adds the file's name.
struct ImagePlugin {
  void (*set_threads)(int threads);
  /// JPEG and TIFF.
  std::vector<unsigned char> (*encode)(const Image& image, const PictureFormat& format, const ImageMetadata& metadata);
  Image (*decode)(const std::filesystem::path& path);
  NativeImage (*decode_native)(const std::filesystem::path& path, const std::string& layer);
};

/// The library, loaded at the first call, from the folder of the program. Any thread may call it.
/// @throw std::runtime_error if it cannot be loaded.
const ImagePlugin& image_plugin();

}  // namespace tensorray
