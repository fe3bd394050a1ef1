#include "renderer/camera/picture_tile.h"

#include <algorithm>

namespace tensorray {

using Eigen::Vector3f;

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

SurfacePicture empty_picture(int width, int height, const ShadedScene& scene) {
  SurfacePicture picture;
  picture.radiance = Film(width, height, static_cast<int>(scene.colors.bands()));
  if (scene.has_traced_light()) picture.landed = Film(width, height, 3);
  if (scene.groups > 0) picture.groups = Film(width, height, 3 * scene.groups);
  const std::size_t size = picture.radiance.plane_size();
  if (scene.region) {
    picture.radiance_scale.assign(size, 1);
    picture.arrives.assign(size, 1);
    picture.deflection.assign(size, 0);
    picture.folds.assign(size, 0);
    picture.texture.assign(size, Eigen::Vector2f::Zero());
  }
  for (auto* plane :
       {&picture.alpha, &picture.depth, &picture.force, &picture.arc_length, &picture.samples, &picture.variance})
    plane->assign(size, 0);
  picture.path.assign(size, -1);
  picture.normal.assign(size, Vector3f::Zero());
  picture.albedo.assign(size, Vector3f::Zero());
  return picture;
}

void add_tile(const Tile& tile, bool transparent, SurfacePicture& picture) {
  for (std::size_t i = 0; i < tile.pixels.size(); ++i) {
    const PixelState& pixel = tile.pixels[i];
    const int x = tile.left + static_cast<int>(i) % tile.width, y = tile.top + static_cast<int>(i) / tile.width;
    const std::size_t index = static_cast<std::size_t>(y) * picture.radiance.width + x;
    const double* light = &tile.light[i * tile.light_values];
    for (Film* film : {&picture.radiance, &picture.landed, &picture.groups})
      for (int channel = 0; channel < film->channels; ++channel) film->plane(channel)[index] = *light++;
    const bool is_opaque = !transparent && pixel.samples > 0;
    picture.alpha[index] = is_opaque ? 1.0f : static_cast<float>(pixel.hits / std::max(1.0, 1.0 * pixel.samples));
    picture.depth[index] = pixel.depth;
    picture.normal[index] = Eigen::Map<const Vector3f>(pixel.normal);
    picture.albedo[index] = Eigen::Map<const Vector3f>(pixel.albedo);
    picture.force[index] = pixel.force;
    picture.arc_length[index] = pixel.arc_length;
    if (!picture.radiance_scale.empty()) {
      picture.radiance_scale[index] = pixel.radiance_scale;
      picture.deflection[index] = pixel.deflection;
      picture.arrives[index] = pixel.arrives;
      picture.folds[index] = pixel.folds;
      picture.texture[index] = Eigen::Map<const Eigen::Vector2f>(pixel.texture);
    }
    picture.path[index] = pixel.path;
    picture.samples[index] = static_cast<float>(pixel.samples);
    picture.variance[index] = pixel.variance();
  }
}

}  // namespace tensorray
