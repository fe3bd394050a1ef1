#pragma once
/// @file renderer/images/image_plugin.h
/// Everything that the program does with OpenImageIO. It is a library of its own, which is loaded when the first
/// picture is read or looked up, or written as JPEG or TIFF: Debian's OpenImageIO brings 260 libraries, which take a
/// quarter of a second to load, and several seconds from a cold disk. Most renders do not wait for them.

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "renderer/images/image.h"

namespace tensorray {

enum class Wrap;

/// How a file format stores pictures.
struct PictureFormat {
  std::string name;                       ///< OpenImageIO's name of the format chooses the writer.
  SampleType type = SampleType::float32;  ///< Of the stored values.
  bool alpha = false;
};

/// A rectangle of pixels within a level, from its upper left one.
struct LevelRectangle {
  int level = 0, x = 0, y = 0, columns = 0, rows = 0;
};

/// Pictures of several sizes (the levels of a MIP map) that give their pixels by rectangles.
struct TileSource {
  virtual ~TileSource() = default;
  virtual int levels() const = 0;
  virtual int width(int level) const = 0;
  virtual int height(int level) const = 0;

  /// Writes R, G, B, A of a rectangle, row by row from the top. Any number of threads may read.
  /// @param row_pixels  Distance between the beginnings of consecutive rows in `rgba`, in pixels.
  virtual void read(const LevelRectangle& part, std::size_t row_pixels, float* rgba) const = 0;
};

/// Looks up single points of a TileSource through a cache of tiles. Any number of threads may look up.
struct TileLookup {
  virtual ~TileLookup() = default;

  /// What the calling thread passes to `lookup`; it stays valid for this thread.
  virtual void* this_thread() const = 0;

  /// @param closest  Whether to take the nearest pixel instead of interpolating linearly.
  /// @param s,t      (0, 0) is the upper left corner of the picture, (1, 1) the lower right one.
  /// @throw std::runtime_error if the source fails.
  virtual void lookup(void* thread, int level, bool closest, float s, float t, float* rgba) const = 0;
};

/// The functions of the library. Errors are std::runtime_error with one line; the caller adds the file's name.
struct ImagePlugin {
  void (*set_threads)(int threads);
  /// JPEG and TIFF.
  std::vector<unsigned char> (*encode)(const Image& image, const PictureFormat& format, const ImageMetadata& metadata);
  Image (*decode)(const std::filesystem::path& path);
  NativeImage (*decode_native)(const std::filesystem::path& path, const std::string& layer);
  /// `source` must outlive the result.
  std::unique_ptr<TileLookup> (*make_lookup)(const TileSource& source, Wrap wrap);
};

/// The library, loaded at the first call, from the folder of the program. Any thread may call it.
/// @throw std::runtime_error if it cannot be loaded.
const ImagePlugin& image_plugin();

}  // namespace tensorray
