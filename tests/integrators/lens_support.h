#pragma once
/// @file tests/integrators/lens_support.h
/// A lens of a cube-shaped field, for tests.

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "integrators/lens/lens.h"
#include "tests/tracing/support.h"

namespace tensorray::test {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;

inline const LensMode modes[] = {LensMode::gather, LensMode::scatter};

/// Across z, its normal +z: light goes along it.
inline Plate plate_at(double z, const Vector2d& size, const Vector2i& resolution = {1, 1}) {
  Plate plate;
  plate.center = {0, 0, z};
  plate.size = size;
  plate.resolution = resolution;
  return plate;
}

/// Noise without a pattern, from SplitMix64.
inline Image noise(int width, int height) {
  Image image(width, height, {"R", "G", "B"});
  std::uint64_t state = 1;
  for (float& value : image.pixels) {
    std::uint64_t z = state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    value = static_cast<float>((z ^ (z >> 31)) >> 40) / (1 << 24);
  }
  return image;
}

inline Image uniform(float value) {
  Image image(16, 16, {"R", "G", "B"});
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

inline BendingSettings precise() {
  BendingSettings settings = settings_of(BendingMethod::dopri5, 0.5);
  settings.tolerance = 1e-8;
  return settings;
}

/// Light along +z from an image to a receiver, either 1.5 from the middle of the field. The channels are R, G and B.
struct Bench {
  TensorField field;
  Surfaces surfaces;
  BendingSettings bending = precise();
  std::vector<LightChannel> channels;
  Plate receiver;
  Texture texture;
  LensImage image;
  LensSettings settings;

  Bench(TensorField field_, const Plate& receiver_, const Vector2d& image_size, Image picture, Wrap wrap = Wrap::none)
      : field(std::move(field_)),
        surfaces(surfaces_of(field)),
        channels{{0.1, 0, 1}},
        receiver(receiver_),
        texture(std::move(picture), wrap) {
    image.texture = &texture;
    image.plane = plate_at(-1.5, image_size);
    image.wraps = wrap == Wrap::repeat || wrap == Wrap::mirror;
  }

  static void radiance(const Vector3d& rgb, std::size_t first, std::size_t last, double* radiances) {
    std::copy(rgb.data() + first, rgb.data() + last, radiances);
  }

  LensPicture simulate(LensMode mode, const Progress& progress = Progress()) const {
    LensSettings with_mode = settings;
    with_mode.mode = mode;
    std::vector<LensBand> bands;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      with_mode.flexibilities.push_back(channels[i].flexibility);
      const double place = channels.size() > 1 ? static_cast<double>(i) / static_cast<double>(channels.size() - 1) : 0;
      bands.push_back({place, place, i, 1, Vector3d::Unit(static_cast<int>(i))});
    }
    const LensLight light =
        trace_lens(field, surfaces, bending, {receiver, image, Vector3d::UnitZ()}, with_mode, progress);
    return draw_lens(light, bands, radiance, channels.size(), true, progress);
  }

  /// Of one channel with flexibility `s`.
  LensPicture simulate(LensMode mode, double s) {
    channels = {{s, 0, 1}};
    return simulate(mode);
  }
};

inline TensorField no_field() { return constant_field(Matrix3d::Zero()); }

inline const LensPoint& point_at(const LensPicture& picture, int x, int y) {
  return picture.points[static_cast<std::size_t>(y * picture.color.width + x)];
}

/// (s, t) at a pixel's centre.
inline Vector2d center_of(int x, int y, const Vector2i& resolution) {
  return {(x + 0.5) / resolution.x(), 1 - (y + 0.5) / resolution.y()};
}

}  // namespace tensorray::test
