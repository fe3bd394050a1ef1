#include "integrators/lens/lens_places.h"

#include <algorithm>
#include <vector>

#include "integrators/lens/lens_view.h"

namespace tensorray {
namespace {

using Eigen::Vector2d;

constexpr double same_place = 1e-3;  // Pixels: sheets whose starts are nearer than this count as one.

/// The landings at the reference.
PlanarMesh mesh_of(const LensLight& light) {
  PlanarMesh mesh;
  const FlowMap& map = light.map;
  std::vector<bool> landed;
  for (std::size_t i = 0; i < map.starts.size(); ++i) {
    const FlowLanding landing = landing_at(map, i, sample_place(light, light.settings.reference));
    mesh.vertices.push_back(landing.at);
    landed.push_back(landing.end == RayEnd::plate);
  }
  for (const FlowTriangle& triangle : map.triangles) {
    const auto& [a, b, c] = triangle.corners;
    if (!triangle.is_torn && landed[a] && landed[b] && landed[c]) mesh.triangles.push_back(triangle.corners);
  }
  return mesh;
}

}  // namespace

PlaceCounter::PlaceCounter(const LensLight& light) : light_(light), mesh_(mesh_of(light)), search_(mesh_) {}

int PlaceCounter::count(const Vector2d& landing) const {
  thread_local std::vector<PlanarHit> hits;
  thread_local std::vector<Vector2d> starts;
  search_.find(landing, hits);
  starts.clear();
  const double least = same_place * light_.setup.receiver.pixel_size().minCoeff();
  for (const PlanarHit& hit : hits) {
    Vector2d start(0, 0);
    for (int i = 0; i < 3; ++i) start += hit.weights[i] * light_.map.starts[mesh_.triangles[hit.triangle][i]];
    if (std::none_of(starts.begin(), starts.end(), [&](const Vector2d& s) { return (s - start).norm() < least; }))
      starts.push_back(start);
  }
  return std::max(1, static_cast<int>(starts.size()));  // At least the pixel itself.
}

}  // namespace tensorray
