#include "renderer/shading/bending_region.h"

namespace tensorray {

std::optional<SurfaceHit> surface_at_end(const SurfaceScene& surfaces, const BentWay& way) {
  constexpr double part = 1e-5;  // Of the scene: how far before the end the surface is looked for.
  const double back = way.on_surface ? part * surfaces.bounds().diagonal().norm() : 0;
  return surfaces.intersect(way.position - back * way.direction, way.direction);
}

}  // namespace tensorray
