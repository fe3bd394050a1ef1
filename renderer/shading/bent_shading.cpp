// RayShader (shading.h): rays that enter the region.

#include <cmath>

#include "renderer/shading/shading.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t first_bent_dimension = 1u << 20;  ///< For wavelengths within their bands; one for each depth.
constexpr double part_of_pixel = 0.2;                     ///< That the bent light of the camera may miss.

}  // namespace

/// Whether a ray enters the region before it meets something at `distance`.
bool RayShader::bends(const Vector3d& origin, const Vector3d& direction, double distance) const {
  return scene_.region && scene_.region->entry(origin, direction) < distance;
}

/// The number of bands for which one that is followed into the region stands.
double RayShader::bands_per_followed(int depth) const {
  if (band_ >= 0) return 1;
  return static_cast<double>(scene_.colors.bands()) / (depth == 0 ? scene_.bands_per_view : scene_.bands_per_bounce);
}

/// Lets a ray wait at the region, for the band of the path; for a path of all bands, for some of them, evenly spaced.
/// Successive samples of a pixel take different bands.
/// @param depth   Number of surfaces that the path has met.
/// @param weight  See WaitingRay.
void RayShader::wait(const Vector3d& origin, const Vector3d& direction, const BandValues& throughput, int depth,
                     double weight, bool seeks_light, const PhotonRivalry& rivalry) {
  PathSampler places = sampler();
  places.dimension = first_bent_dimension + static_cast<std::uint32_t>(depth);
  BentWay way;
  way.place = places.next_1d();
  if (depth == 0) way.tolerance = part_of_pixel * settings_.pixel_angle;
  way.position = origin;
  way.direction = direction;
  WaitingRay waiting;
  waiting.ray = ray_;
  waiting.depth = depth;
  waiting.seeks_light = seeks_light;
  waiting.share = bands_per_followed(depth);
  waiting.stands = stands_ * waiting.share;
  waiting.weight = weight;
  waiting.rivalry = rivalry;
  waiting.direction = direction;
  waiting.first = waiting_.ways.size();
  const int bands = static_cast<int>(scene_.colors.bands()), parts = static_cast<int>(waiting.share);
  const int first = static_cast<int>((places.pixel + places.sample) % static_cast<std::uint64_t>(parts));
  for (int band = band_ < 0 ? first : band_; band < bands; band += band_ < 0 ? parts : bands) {
    if (!(throughput_[band - first_band()] > 0)) continue;
    way.band = band;
    waiting_.ways.push_back(way);
    waiting_.throughput.push_back(throughput[band - first_band()]);
  }
  waiting.last = waiting_.ways.size();
  waiting_.rays.push_back(waiting);
}

/// Continues the path of a ray that has left the region as a path for each band.
void RayShader::continue_path(const WaitingRay& waiting) {
  if (waiting.depth == 0) see_bent(waiting);
  for (std::size_t i = waiting.first; i < waiting.last; ++i)
    if (followed_.ways[i].arrives) continue_band(waiting, i);
  if (auto& seen = views_[ray_].surface; seen && waiting.depth == 0) {
    set_reflectance(seen->hit, 0, albedo_);
    set_albedo(*seen, albedo_);
  }
}

/// Sets what the region does to a ray of the camera.
void RayShader::see_bent(const WaitingRay& waiting) {
  BentView view{0, 0, 0};
  const auto count = static_cast<double>(waiting.last - waiting.first);
  for (std::size_t i = waiting.first; i < waiting.last; ++i) {
    const BentWay& way = followed_.ways[i];
    if (!way.arrives) continue;
    const Vector3d& before = waiting.direction;
    view.gain += way.gain / count;
    view.deflection += std::atan2(way.direction.cross(before).norm(), way.direction.dot(before)) / count;
    view.arrives += 1 / count;
  }
  views_[ray_].bent = view;
}

/// @param number  Of the way.
void RayShader::continue_band(const WaitingRay& waiting, std::size_t number) {
  const BentWay& way = followed_.ways[number];
  const bool is_view = waiting.depth == 0;
  carry(way.band);
  stands_ = waiting.stands;
  throughput_[0] = followed_.throughput[number] * (way.gain * waiting.share);
  const auto hit = surface_at_end(scene_.surfaces, way);
  if (!hit) {
    if (!is_view || show_background_) add_background(way.direction, waiting.weight, waiting.depth, is_view);
    return;
  }
  if (settings_.shading == Shading::path)
    add_emission(*hit, way.direction, waiting.weight * share_beside_photons(waiting, way, *hit), waiting.depth);
  if (!is_view && waiting.depth == settings_.max_depth) return;
  const Vertex vertex = make_vertex(*hit, way.direction);
  const bool is_to_middle = number - waiting.first <= (waiting.last - waiting.first) / 2;
  if (is_view && is_to_middle) views_[ray_].surface = FirstSurface{*hit, vertex.normal, way.direction};
  shade_surface(vertex, waiting.depth + 1);
}

/// Looks for the light of `light_sample_` through the region: follows its direction, and will add the light that it
/// meets, whatever that is. The density is that of the direction at the surface, so that bending does not change it.
/// Needs f in `contribution_`.
void RayShader::seek_bent_light(const Vertex& vertex, const Vector3d& wi, const Vector3d& start, int depth) {
  if (!aims_bent_ || light_sample_.is_delta) return;
  const Vector3d& direction = light_sample_.direction;
  const double density = scene_.lights.direction_pdf(vertex.point, direction);
  if (!(density > 0)) return;
  if (scene_.surfaces.occluded(start, direction, scene_.region->entry(start, direction))) return;
  double factor = std::abs(wi.z()) / density, others = 1;
  if (settings_.direct == DirectLight::both) {
    const double ratio = pdf(*vertex.material, reflectance_, wi, vertex.wo) / density;
    others = 1 + ratio * ratio;
    factor /= others;
  }
  contribution_ = factor * contribution_ * throughput_;
  wait(start, direction, contribution_, depth, 1 / others, true, rivalry(vertex, direction, density, depth));
}

/// Adds the light that a ray has met which seeks it.
void RayShader::bring_light(const WaitingRay& waiting) {
  for (std::size_t i = waiting.first; i < waiting.last; ++i) {
    const BentWay& way = followed_.ways[i];
    if (!way.arrives) continue;
    const auto hit = surface_at_end(scene_.surfaces, way);
    const int light = hit ? scene_.surfaces.surfaces()[hit->surface].light : -1;
    if (hit && light < 0) continue;
    carry(way.band);
    stands_ = waiting.stands;
    throughput_[0] = followed_.throughput[i] * (way.gain * waiting.share);
    if (hit)
      add_emission(*hit, way.direction, share_beside_photons(waiting, way, *hit), waiting.depth);
    else
      add_background(way.direction, 1, waiting.depth, false);
  }
}

}  // namespace tensorray
