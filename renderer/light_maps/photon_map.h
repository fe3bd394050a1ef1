#pragma once
/// Photons where they have landed on surfaces, and the irradiance that they give (Jensen 1996). The photons of one pass
/// have one radius. Over the passes it shrinks, so that the mean over them converges to the truth (Knaus and Zwicker
/// 2011, "Progressive Photon Mapping: A Probabilistic Approach").

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "renderer/lights/photon_emitter.h"
#include "renderer/surfaces/plate.h"
#include "renderer/surfaces/surface_scene.h"

namespace tensorray {

/// Single precision: seven digits of world coordinates.
struct Photon {
  Eigen::Vector3f position;   ///< World.
  Eigen::Vector3f direction;  ///< Unit; in which it travelled.
  Eigen::Vector3f normal;     ///< Unit, geometric, of the surface.
  std::uint32_t surface = 0;  ///< Index of the surface.
  std::int32_t light = 0;     ///< Index of the light that it comes from.
  std::int32_t band = 0;
  double power = 0;    ///< In its band. Like the density in double precision: areas are in any unit.
  double density = 0;  ///< Of an area light: expected number of photons of the pass and band, per area across their
                       ///< direction and per steradian, where this one has landed. Of other lights: 0.
};

/// The radius of a pass: r²(pass + 1) / r²(pass) = (pass + 1 + α) / (pass + 2), α = ⅔. @param pass  From 0.
double photon_radius(double first, int pass);

/// An area light whose light photons find through the region, as other techniques do (multiple importance sampling).
struct AreaPhotons {
  PhotonEmitter emitter;
  double count = 0;            ///< Photons of a band in each pass.
  std::vector<bool> surfaces;  ///< By index: whether photons light them.
};

/// The photons of one pass, sorted by cells of a lattice, then by band, then by their order before. Immutable.
class PhotonMap {
 public:
  /// @param radius  Within which a photon lights its surface, world units; > 0.
  PhotonMap(std::vector<Photon> photons, double radius);

  /// Calls `use(photon, density)` for all photons that light a point, in their order. The irradiance of the point is
  /// the sum of power × density: the kernel of Epanechnikov across the surface, 2 / (π r²) (1 − d² / r²).
  /// Photons of other surfaces, of parts that face elsewhere (more than 45°), and off the point's plane do not count.
  /// @param band  The band that is looked for; −1: all.
  template <class Use>
  void visit(const SurfaceHit& point, int band, const Use& use) const;

  double radius() const { return radius_; }
  const std::vector<Photon>& photons() const { return photons_; }

 private:
  struct Cell {
    std::uint64_t key = 0;
    std::size_t begin = 0;  ///< Index of its first photon.
  };

  Eigen::Array3i cell_of(const Eigen::Vector3d& position) const;
  static std::uint64_t key_of(const Eigen::Array3i& cell);
  double density(const Photon& photon, const SurfaceHit& point) const;

  double radius_;
  double cell_size_ = 1;
  Eigen::Vector3d corner_ = Eigen::Vector3d::Zero();
  std::vector<Photon> photons_;
  std::vector<Cell> cells_;  ///< By key, with an end.
};

/// Where photons went: they met a surface before the region (straight light, which photons do not count), landed on a
/// surface after it, left everything, or could not be followed.
enum class PhotonEnd { before, landed, escaped, stopped };
constexpr int photon_end_count = 4;

/// Photons that were emitted, counted there, and by their end, counted there: the sums are the same.
struct PhotonCounts {
  std::uint64_t emitted = 0;
  std::array<std::uint64_t, photon_end_count> ends{};

  PhotonCounts& operator+=(const PhotonCounts& more) {
    emitted += more.emitted;
    for (std::size_t end = 0; end < ends.size(); ++end) ends[end] += more.ends[end];
    return *this;
  }
  bool operator==(const PhotonCounts& other) const { return emitted == other.emitted && ends == other.ends; }
};

/// The photons of all passes.
struct PhotonMaps {
  std::vector<PhotonMap> passes;                  ///< The photons that `serves` wants.
  std::vector<PhotonCounts> counts;               ///< Of each pass.
  std::vector<std::optional<AreaPhotons>> areas;  ///< By light; those of area lights that have photons.
};

template <class Use>
void PhotonMap::visit(const SurfaceHit& point, int band, const Use& use) const {
  if (photons_.empty()) return;
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius_);
  const Eigen::Array3i low = cell_of(point.position - reach), high = cell_of(point.position + reach);
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y) {
      const std::uint64_t last = key_of({high.x(), y, z});
      auto cell = std::lower_bound(cells_.begin(), cells_.end() - 1, key_of({low.x(), y, z}),
                                   [](const Cell& each, std::uint64_t key) { return each.key < key; });
      for (; cell + 1 != cells_.end() && cell->key <= last; ++cell) {
        auto photon = photons_.begin() + static_cast<std::ptrdiff_t>(cell->begin);
        const auto end = photons_.begin() + static_cast<std::ptrdiff_t>((cell + 1)->begin);
        if (band >= 0)
          photon =
              std::lower_bound(photon, end, band, [](const Photon& each, int wanted) { return each.band < wanted; });
        for (; photon != end && (band < 0 || photon->band == band); ++photon)
          if (const double weight = density(*photon, point); weight > 0) use(*photon, weight);
      }
    }
}

// Light that reaches a surface on bent ways, computed beforehand.

/// The irradiance of one side of a flat surface, or of the points of a body that straight light would reach if it met
/// nothing else. A surface scatters it as if it arrived straight from the light, which is exact for diffuse materials.
struct IrradianceMap {
  std::uint32_t surface = 0;  ///< Index of the surface.
  int light = -1;             ///< Index of the light that it comes from.
  Plate plate;  ///< The part of the surface that has this light; elsewhere there is none. Of a body: a plane across the
                ///< light, on which its points are projected.
  std::shared_ptr<const SurfaceScene> body;  ///< The surface alone, if it is not flat.
  double side = 1;                           ///< 1: the side of the plate's normal is lit; −1: the other side.
  std::optional<Eigen::Vector3d> source;     ///< Of a point light: where it is.
  Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();  ///< Unit; from the surface to a distant light, on the lit side.
  Eigen::Index bands = 0;
  std::vector<float> irradiance;  ///< On `plate`, in every band, pixel after pixel.
  /// On `plate`: the part of each pixel whose straight light comes through the region; instead of it, there is this
  /// map. Empty: whether it does is asked at each point, which leaves a seam where the map's pixels are large.
  std::vector<float> straight;
  std::vector<float> folds;  ///< On `plate`: the number of sheets of light that lie on each other.
};

/// Light that grazes a plate straight may come from above it when it is bent: it counts as if it came from above.
constexpr double grazing_cosine = 0.05;

/// Unit; from a point of the surface to the light.
Eigen::Vector3d direction_towards(const IrradianceMap& light, const Eigen::Vector3d& point);

/// Whether a point of the surface may have this light. @param ray  Direction of the ray that found the point.
bool is_lit(const IrradianceMap& light, const Eigen::Vector3d& point, const Eigen::Vector3d& ray);

/// `straight` at a point of the surface, as smooth as the irradiance; nothing beside the map.
std::optional<double> straight_at(const IrradianceMap& light, const Eigen::Vector3d& point);

/// The number of sheets at a point of the surface; 0 where there is no light.
float folds_at(const IrradianceMap& light, const Eigen::Vector3d& point);

/// Adds the irradiance of the plate at a point of the surface to `sum`, with linear interpolation between pixels; up to
/// the plate's edge, its outermost pixels go on. On a body it is that of a surface that faces the light.
/// @param sum  Of the bands from `first_band` on.
void add_irradiance(const IrradianceMap& light, const Eigen::Vector3d& point, Eigen::ArrayXd& sum,
                    Eigen::Index first_band = 0);

}  // namespace tensorray
