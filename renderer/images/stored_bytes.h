#pragma once
/// @file renderer/images/stored_bytes.h
/// How large a picture's values are, checked before memory is taken for them.

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "renderer/images/image.h"

namespace tensorray {

inline std::size_t bytes_of(SampleType type) {
  return type == SampleType::uint8 ? 1 : type == SampleType::uint16 ? 2 : 4;
}

/// The number of bytes of a picture's values. @throw std::runtime_error if there are more than 8 GiB, or the picture
/// has no size. Sums of sizes and places of pictures that pass are integers of 32 bits.
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
