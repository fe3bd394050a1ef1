#include "renderer/lights/bending_region.h"

namespace tensorray {

std::optional<SurfaceHit> surface_at_end(const SurfaceScene& surfaces, const BentRay& ray) {
  constexpr double part = 1e-5;  // Of the scene: how far before the end the surface is looked for.
  const double back = ray.on_surface ? part * surfaces.bounds().diagonal().norm() : 0;
  return surfaces.intersect(ray.position - back * ray.direction, ray.direction);
}

}  // namespace tensorray
