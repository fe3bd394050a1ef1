#include <cmath>

#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

Eigen::Map<const Eigen::ArrayXf> as_array(const std::vector<float>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

/// The background's light is divided as the radiances of its lights.
void add_to_groups(Wavefront& front, const PathState& path, const BandValues& light, const LightSource& source) {
  const ShadedScene& scene = front.scene;
  const Eigen::Index first = front.column(path.ray + 1) - scene.groups;
  const auto group_of = [&](int each) { return scene.group_of_light[static_cast<std::size_t>(each)]; };
  const auto layer_of = [&](int each) {
    return front.light.col(first + group_of(each)).segment(path.first_band(), light.size());
  };
  if (source.light >= 0) {
    if (group_of(source.light) >= 0) layer_of(source.light) += light;
    return;
  }
  std::vector<float>& radiance = front.memory.of_one_light;
  for (int each = 0; each < static_cast<int>(scene.group_of_light.size()); ++each) {
    if (group_of(each) < 0) continue;
    scene.lights.background(source.direction, radiance, source.disks, each, path.bands());
    auto layer = layer_of(each);
    for (std::size_t band = 0; band < radiance.size(); ++band)
      if (const auto i = static_cast<Eigen::Index>(band); radiance[band] > 0)
        layer[i] += light[i] * radiance[band] / (*source.radiance)[band];
  }
}

}  // namespace

void add_light(Wavefront& front, const PathState& path, BandValues& light, const LightSource& source) {
  const double brightness_of_light = brightness(front.scene, path, light), most = front.settings.indirect_clamp;
  if (!std::isfinite(brightness_of_light)) return;
  if (path.depth >= 2 && most > 0 && brightness_of_light > most) light *= most / brightness_of_light;
  front.light.col(front.column(path.ray)).segment(path.first_band(), light.size()) += light;
  if (front.scene.groups > 0) add_to_groups(front, path, light, source);
}

void add_background(Wavefront& front, const PathState& path, const Vector3d& direction, double weight, bool disks) {
  if (!(weight > 0)) return;
  std::vector<float>& radiance = front.memory.background;
  front.scene.lights.background(direction, radiance, disks, -1, path.bands());
  BandValues& light = front.memory.contribution;
  light = path.throughput * as_array(radiance).cast<double>() * weight;
  add_light(front, path, light, {-1, direction, disks, &radiance});
}

void add_emission(Wavefront& front, const PathState& path, const SurfaceHit& hit, const Vector3d& direction,
                  double weight) {
  const int light = front.scene.surfaces.surfaces()[hit.surface].light;
  if (light < 0 || !(weight > 0)) return;
  const std::vector<float>* emitted = front.scene.lights.emitted(light, hit.normal, direction);
  if (emitted == nullptr) return;
  BandValues& found = front.memory.contribution;
  found =
      path.throughput * as_array(*emitted).segment(path.first_band(), path.throughput.size()).cast<double>() * weight;
  add_light(front, path, found, {light});
}

}  // namespace tensorray
