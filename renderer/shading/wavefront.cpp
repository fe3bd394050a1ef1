#include "renderer/shading/wavefront.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

/// Least cosine between the shading normal and the direction to the viewer. Interpolated normals can place the viewer
/// below a surface that is seen from above.
constexpr double min_cosine = 0.01;

/// The shading normal on the side that `direction` comes from, turned so that the viewer is above the surface. Without
/// this, silhouettes of coarse meshes have black fringes. The geometric normal does not change.
Vector3d facing_normal(const SurfaceHit& hit, const Vector3d& direction, double side) {
  const Vector3d normal = side * hit.shading_normal;
  const double cosine = -normal.dot(direction), least = std::min(min_cosine, -side * hit.normal.dot(direction));
  return cosine < least ? Vector3d((normal + (cosine - least) * direction).normalized()) : normal;
}

const Material& material_of(const ShadedScene& scene, const SurfaceHit& hit) {
  return scene.materials[scene.surfaces.surfaces()[hit.surface].material];
}

}  // namespace

void set_reflectance(const ShadedScene& scene, const SurfaceHit& hit, Eigen::Index first_band,
                     BandValues& reflectance) {
  const ShadedSurface& surface = scene.surfaces.surfaces()[hit.surface];
  if (surface.colors.empty() && !surface.texture)
    reflectance = scene.materials[surface.material].reflectance.segment(first_band, reflectance.size());
  else
    scene.colors.reflectance(hit.color, reflectance, first_band);
}

void meet_surface(const ShadedScene& scene, const SurfaceHit& hit, const Vector3d& direction, PathState& path) {
  ++path.depth;
  Vertex& vertex = path.vertex;
  vertex.hit = hit;
  vertex.direction = direction;
  vertex.material = &material_of(scene, hit);
  vertex.side = hit.normal.dot(direction) > 0 ? -1 : 1;
  vertex.point = is_glass(*vertex.material) ? hit.position : hit.lifted_position;
  vertex.normal = facing_normal(hit, direction, vertex.side);
  vertex.frame = frame_about(vertex.side * vertex.normal);
  vertex.reflectance.resize(path.throughput.size());
  set_reflectance(scene, hit, path.first_band(), vertex.reflectance);
  vertex.view = viewed(*vertex.material, vertex.reflectance, vertex.to_local(-direction), path.first_band());
}

Eigen::Vector3f albedo(const ShadedScene& scene, const SurfaceHit& hit, BandValues& reflectance) {
  if (const BandValues* const fresnel = mean_fresnel(material_of(scene, hit))) reflectance *= *fresnel;
  return scene.colors.color(reflectance);
}

}  // namespace tensorray
