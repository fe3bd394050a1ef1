#include "renderer/light_maps/photon_map.h"

#include <cmath>
#include <tuple>

#include <Eigen/Geometry>

#include "base/constants.h"

namespace tensorray {
namespace {

constexpr int cells_along_axis = 1 << 20;  // At most; keys have 21 bits for each axis.
constexpr double min_agreement = 0.7;      // Between the normals of a photon's surface and of the point's.
constexpr double max_height = 0.25;        // Of a photon above the point's plane, in radii.

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

}  // namespace tensorray
