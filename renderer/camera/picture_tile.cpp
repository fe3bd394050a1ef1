#include "renderer/camera/picture_tile.h"

#include <algorithm>

namespace tensorray {

Tile::Tile(int left_, int top_, int width_, int height_, std::size_t light_values_)
    : left(left_),
      top(top_),
      width(width_),
      height(height_),
      light_values(light_values_),
      pixels(static_cast<std::size_t>(width_) * height_),
      light(pixels.size() * light_values_) {}

int Tile::samples() const {
  int most = 0;
  for (const PixelState& pixel : pixels) most = std::max(most, pixel.samples);
  return most;
}

void Tile::copy(Archive& archive) {
  std::uint64_t done = is_done;
  archive.copy(done);
  archive.copy(pixels.data(), pixels.size() * sizeof pixels[0]);
  archive.copy(light.data(), light.size() * sizeof light[0]);
  is_done = done != 0;
}

SurfacePicture empty_picture(int width, int height, bool transparent, const ShadedScene& scene) {
  SurfacePicture picture;
  picture.radiance = Film(width, height, static_cast<int>(scene.colors.bands()));
  if (scene.has_traced_light()) picture.landed = Film(width, height, 3);
  if (scene.groups > 0) picture.groups = Film(width, height, 3 * scene.groups);
  picture.pixels.resize(picture.radiance.plane_size());
  picture.transparent = transparent;
  picture.bends = scene.region != nullptr;
  return picture;
}

void add_tile(const Tile& tile, SurfacePicture& picture) {
  for (std::size_t i = 0; i < tile.pixels.size(); ++i) {
    const int x = tile.left + static_cast<int>(i) % tile.width, y = tile.top + static_cast<int>(i) / tile.width;
    const std::size_t index = static_cast<std::size_t>(y) * picture.radiance.width + x;
    const double* light = &tile.light[i * tile.light_values];
    for (Film* film : {&picture.radiance, &picture.landed, &picture.groups})
      for (int channel = 0; channel < film->channels; ++channel) film->plane(channel)[index] = *light++;
    picture.pixels[index] = tile.pixels[i];
  }
}

float SurfacePicture::alpha(std::size_t pixel) const {
  const PixelState& state = pixels[pixel];
  if (!transparent && state.samples > 0) return 1;
  return static_cast<float>(state.depth.count / std::max(1.0, 1.0 * state.samples));
}

}  // namespace tensorray
