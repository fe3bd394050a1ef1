#pragma once
/// @file integrators/view/field_region.h
/// A tensor field as the viewer of a scene sees through it: light is followed backwards, which is Eq. 5 with −s. Ways
/// with a tolerance are interpolated (band_interpolation.h) where the traced ones leave the volume by one face of its
/// box, and no obstacle is within it.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "integrators/bending/bending.h"
#include "integrators/view/band_interpolation.h"
#include "renderer/shading/bending_region.h"

namespace tensorray {

/// What light keeps on its way through the field. Both are consistent, and differ in what they call physical.
enum class Conserve {
  power,     ///< A photon's power, as on the plates of this project: radiance changes (RayBatch).
  radiance,  ///< Radiance, as in the lens of this project: a photon's power changes instead.
};

struct FieldViewSettings {
  BendingSettings bending;  ///< With the scale of the field.
  Conserve conserve = Conserve::power;
  double most_gain = 0;  ///< Greatest factor on radiance, > 0, or 0: no limit. The limit loses light and is counted.
  /// Flexibility of the light at a place, 0 to 1, within a band. Any thread may call it.
  std::function<double(int band, double place)> flexibility;
};

/// Field and geometry must outlive it.
class FieldRegion final : public BendingRegion {
 public:
  /// @param geometry  Bounds, cut, and all obstacles that lie in the volume. Ways end on them; those that leave the
  ///                  volume may end on obstacles outside it, too. Ways may start on obstacles; nothing is looked for
  ///                  before the volume.
  FieldRegion(const TensorField& field, const Geometry& geometry, FieldViewSettings settings);

  double entry(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const override;
  void follow_back(std::vector<BentWay>& ways) const override;
  void follow_light(std::vector<BentWay>& ways) const override;

  /// Tensor samples and steps of all ways so far.
  std::uint64_t tensor_samples() const { return tensor_samples_; }
  std::uint64_t steps() const { return steps_; }

  /// Ways followed back so far, by their end, without those that were interpolated; those that were limited.
  std::uint64_t ways(RayEnd end) const { return ends_[static_cast<std::size_t>(end)]; }
  std::uint64_t limited() const { return limited_; }

 private:
  Eigen::Vector3d start_of(const BentWay& way) const;
  void follow(double sign, bool gains, std::vector<BentWay>& ways) const;
  void follow_some(const std::vector<std::size_t>& which, std::vector<BentWay>& ways) const;
  void follow_groups(std::vector<BandGroup> groups, std::vector<BentWay>& ways) const;
  bool end_alike(const BandGroup& group, const std::vector<BentWay>& ways) const;
  int face_at(const Eigen::Vector3d& position) const;

  const TensorField& field_;
  const Geometry& geometry_;
  FieldViewSettings settings_;
  double rounding_;  ///< World units.
  mutable tbb::enumerable_thread_specific<RayBatch> memory_;
  mutable std::array<std::atomic<std::uint64_t>, ray_end_count> ends_{};
  mutable std::atomic<std::uint64_t> limited_{0}, tensor_samples_{0}, steps_{0};
};

}  // namespace tensorray
