#pragma once
/// A tensor field in the view of a camera. Light is followed backwards, by Eq. 5 with −s. If there are no obstacles,
/// some ways that allow a tolerance are interpolated (BandGroup). The traced ways of their group must leave the volume
/// through the same face of its box.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "renderer/lights/bending_region.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"

namespace tensorray {

/// Ways [first, first + count) of a list, in the order of their bands: those of one ray. Almost everywhere, the way of
/// light is a smooth function of its wavelength. A polynomial through Chebyshev nodes is used if one more band agrees.
struct BandGroup {
  std::size_t first = 0, count = 0;
  std::vector<std::size_t> nodes;  ///< Indices of the ways that interpolation is made of; ascending.
  std::size_t check = 0;           ///< Index of the way that it must agree with.

  bool is_traced(std::size_t way) const;  ///< Whether the way is a node or the check.
};

/// The groups in which ways may be interpolated: 6 or more neighbours that start alike and allow a `tolerance`.
std::vector<BandGroup> interpolation_groups(const std::vector<BentRay>& ways);

/// Whether the nodes predict the check: its direction within its tolerance, its position within the tolerance as seen
/// from `start`, and its jacobian within 1%. All of these ways must have been traced, and must arrive.
/// @param start  Where the ways of the group started.
bool is_predictable(const BandGroup& group, const std::vector<BentRay>& ways, const Eigen::Vector3d& start);

/// Sets position, direction, jacobian and `arrives` of the ways that were not traced.
void interpolate(const BandGroup& group, std::vector<BentRay>& ways);

/// What stays constant along light in the field. Each choice is consistent; they are different models of the medium.
enum class Conserve {
  power,     ///< A photon's power, as on the plates of this project: radiance changes (RayBatch).
  radiance,  ///< Radiance, as in the lens of this project: a photon's power changes instead.
};

struct FieldViewSettings {
  BendingSettings bending;  ///< With the scale of the field.
  Conserve conserve = Conserve::power;
  double max_radiance_scale = 0;  ///< Greatest factor on radiance, > 0, or 0: no limit. Limited ways lose light.
  /// Flexibility of the light at a place, 0 to 1, within a band. Any thread may call it.
  std::function<double(int band, double place)> flexibility;
};

/// Field and geometry must outlive it.
class FieldRegion final : public BendingRegion {
 public:
  /// @param geometry  Bounds, cut, and all obstacles that lie in the volume. Ways end on them; those that leave the
  ///                  volume may end on obstacles outside it, too. Ways may start on obstacles. Obstacles in front of
  ///                  the volume are not looked for.
  FieldRegion(const TensorField& field, const Geometry& geometry, FieldViewSettings settings);

  double entry(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const override;
  void trace_radiance(std::vector<BentRay>& ways) const override;
  void trace_importance(std::vector<BentRay>& ways) const override;

  /// Tensor samples and steps of all ways so far.
  std::uint64_t tensor_samples() const { return tensor_samples_; }
  std::uint64_t steps() const { return steps_; }

  /// Number of ways that were followed back, and to this end. Interpolated ways do not count.
  std::uint64_t ways() const { return ways_; }
  std::uint64_t ways(RayEnd end) const { return ends_[static_cast<std::size_t>(end)]; }
  /// Number of ways whose factor on radiance was above the limit.
  std::uint64_t limited() const { return limited_; }

 private:
  Eigen::Vector3d start_of(const BentRay& way) const;
  void follow(double sign, bool scales, std::vector<BentRay>& ways) const;
  void follow_some(const std::vector<std::size_t>& which, std::vector<BentRay>& ways) const;
  void follow_groups(std::vector<BandGroup> groups, std::vector<BentRay>& ways) const;
  bool end_alike(const BandGroup& group, const std::vector<BentRay>& ways) const;
  int face_at(const Eigen::Vector3d& position) const;

  const TensorField& field_;
  const Geometry& geometry_;
  FieldViewSettings settings_;
  double rounding_;  ///< World units.
  mutable tbb::enumerable_thread_specific<RayBatch> memory_;
  mutable std::array<std::atomic<std::uint64_t>, ray_end_count> ends_{};
  mutable std::atomic<std::uint64_t> limited_{0}, ways_{0}, tensor_samples_{0}, steps_{0};
};

}  // namespace tensorray
