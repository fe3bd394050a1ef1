#include "renderer/light_maps/photon_map.h"

#include <cmath>
#include <tuple>

#include <Eigen/Geometry>

#include "base/constants.h"

namespace tensorray {
namespace {

using Eigen::Vector3d;

constexpr int cells_along_axis = 1 << 20;  // At most; keys have 21 bits for each axis.
constexpr double min_agreement = 0.7;      // Between the normals of a photon's surface and of the point's.
constexpr double max_height = 0.25;        // Of a photon above the point's plane, in radii.

constexpr double rounding = 1e-3;  // Pixels by which a point of the surface may lie beside its plate.

/// The place of a point of the surface on the plate.
Vector3d place_of(const IrradianceMap& light, const Vector3d& point) {
  if (!light.body || !light.source) return point;  // Pixels are those of the point's projection along the normal.
  return projected_from(*light.source, light.plate, point);
}

/// Calls `use(pixel, weight)` for the pixels about a place on the plate, for linear interpolation. Beyond the centres
/// of the outermost pixels, these alone count. @return false beside the plate.
template <class Use>
bool interpolate(const Plate& plate, const Vector3d& place, const Use& use) {
  const Eigen::Array2d at = plate.to_pixel(place), size = plate.resolution.cast<double>();
  if (!((at > -rounding).all() && (at < size + rounding).all())) return false;
  const Eigen::Array2d between = (at - 0.5).max(0).min(size - 1), corner = between.floor(), part = between - corner;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      const int x = static_cast<int>(corner.x()) + i, y = static_cast<int>(corner.y()) + j;
      const double weight = (i == 1 ? part.x() : 1 - part.x()) * (j == 1 ? part.y() : 1 - part.y());
      if (weight > 0)
        use(static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x()) + static_cast<std::size_t>(x), weight);
    }
  return true;
}

}  // namespace

double photon_radius(double first, int pass) {
  constexpr double alpha = 2.0 / 3;
  double squared = first * first;
  for (int p = 1; p <= pass; ++p) squared *= (p + alpha) / (p + 1);
  return std::sqrt(squared);
}

PhotonMap::PhotonMap(std::vector<Photon> photons, double radius) : radius_(radius) {
  Eigen::AlignedBox3d box;
  for (const Photon& photon : photons) box.extend(photon.position.cast<double>());
  if (photons.empty()) return;
  corner_ = box.min();
  cell_size_ = std::max(radius, box.sizes().maxCoeff() / (cells_along_axis - 2));
  struct Place {
    std::uint64_t key;
    std::int32_t band;
    std::size_t index;
    bool operator<(const Place& other) const {
      return std::tie(key, band, index) < std::tie(other.key, other.band, other.index);
    }
  };
  std::vector<Place> places(photons.size());
  for (std::size_t i = 0; i < photons.size(); ++i)
    places[i] = {key_of(cell_of(photons[i].position.cast<double>())), photons[i].band, i};
  std::sort(places.begin(), places.end());
  photons_.reserve(photons.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i == 0 || places[i].key != places[i - 1].key) cells_.push_back({places[i].key, i});
    photons_.push_back(photons[places[i].index]);
  }
  cells_.push_back({~std::uint64_t{0}, photons_.size()});
}

/// From 0 to cells_along_axis − 1; points beside the photons are in the outermost cells, whose photons are too far.
Eigen::Array3i PhotonMap::cell_of(const Eigen::Vector3d& position) const {
  return ((position - corner_).array() / cell_size_)
      .floor()
      .max(0)
      .min(static_cast<double>(cells_along_axis - 1))
      .cast<int>();
}

std::uint64_t PhotonMap::key_of(const Eigen::Array3i& cell) {
  const auto part = [&](int axis) { return static_cast<std::uint64_t>(cell[axis]); };
  return (part(2) << 42) | (part(1) << 21) | part(0);
}

double PhotonMap::density(const Photon& photon, const SurfaceHit& point) const {
  if (photon.surface != point.surface) return 0;
  const Eigen::Vector3d way = photon.position.cast<double>() - point.position;
  const double height = way.dot(point.normal), squared = radius_ * radius_;
  const double distance = way.squaredNorm() - height * height;
  if (!(distance < squared) || std::abs(height) > max_height * radius_) return 0;
  if (photon.normal.cast<double>().dot(point.normal) < min_agreement) return 0;
  return 2 / (pi * squared) * (1 - distance / squared);
}

Vector3d direction_towards(const IrradianceMap& light, const Vector3d& point) {
  if (!light.source) return light.towards;
  const Vector3d towards = (*light.source - point).normalized(), normal = light.side * light.plate.normal();
  return light.body || towards.dot(normal) > grazing_cosine ? towards : normal;
}

bool is_lit(const IrradianceMap& light, const Vector3d& point, const Vector3d& ray) {
  if (!light.body) return (light.plate.normal().dot(ray) < 0) == (light.side > 0);
  const double off = 1e-4 * light.body->bounds().diagonal().norm();
  const Vector3d towards = direction_towards(light, point);
  return !light.body->occluded(point + off * towards, towards);
}

void add_irradiance(const IrradianceMap& light, const Vector3d& point, Eigen::ArrayXd& sum, Eigen::Index first_band) {
  const Vector3d place = place_of(light, point);
  double radiance_scale = 1;
  if (light.body && light.source) {  // From the plate to a surface at the point that faces the light.
    const Vector3d to_plate = place - *light.source;
    const double cosine = std::abs(light.plate.normal().dot(to_plate)) / to_plate.norm();
    radiance_scale = to_plate.squaredNorm() / ((point - *light.source).squaredNorm() * cosine);
  }
  interpolate(light.plate, place, [&](std::size_t pixel, double weight) {
    const float* const irradiance =
        light.irradiance.data() + static_cast<Eigen::Index>(pixel) * light.bands + first_band;
    sum += radiance_scale * weight * Eigen::Map<const Eigen::ArrayXf>(irradiance, sum.size()).cast<double>();
  });
}

std::optional<double> straight_at(const IrradianceMap& light, const Vector3d& point) {
  if (light.straight.empty()) return std::nullopt;
  double sum = 0;
  const bool is_there = interpolate(light.plate, place_of(light, point),
                                    [&](std::size_t pixel, double weight) { sum += weight * light.straight[pixel]; });
  return is_there ? std::optional(sum) : std::nullopt;
}

float folds_at(const IrradianceMap& light, const Vector3d& point) {
  const Eigen::Vector2d at = light.plate.to_pixel(place_of(light, point));
  const Eigen::Vector2i& size = light.plate.resolution;
  if (!((at.array() >= 0).all() && (at.array() < size.cast<double>().array()).all())) return 0;
  const auto pixel =
      static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(size.x()) + static_cast<std::size_t>(at.x());
  return pixel < light.folds.size() ? light.folds[pixel] : 0;
}

}  // namespace tensorray
