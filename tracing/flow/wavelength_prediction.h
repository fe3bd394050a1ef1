#pragma once
/// @file tracing/flow/wavelength_prediction.h
/// Predicts the landings of a vertex at wavelength samples that are not traced: from its traced ones, and from those of
/// the vertices between which it lies.

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "tracing/flow/flow_map.h"

namespace tensorray {

constexpr std::size_t range_samples = 33;  // Wavelength samples of a range.

/// The vertices in whose middle a new one lies: the ends of a side, or the corners of a quad. All of them are traced.
struct Parents {
  std::array<std::uint32_t, 4> vertices{};
  std::size_t count = 0;  ///< 0, 2 or 4.
};

/// The landings of a vertex at all samples, of which every `step`-th is traced; step: 16, 8, 4, 2 or 1.
///
/// A polynomial through the nearest known samples predicts the others: a parabola if three are known, else a cubic
/// through four. If all light of the parents lands, the errors that the same polynomials would have made for the
/// parents are known. Their mean is added, so that only what differs from vertex to vertex remains as an error. Each
/// quarter of the range is predicted on its own, as soon as it can be. Thus all samples are needed only near a kink.
class WavelengthPrediction {
 public:
  /// @param plate  Width and height of the plate, pixels.
  WavelengthPrediction(FlowMap& map, std::size_t vertex, const Parents& parents, const Eigen::Array2f& plate);

  /// Whether the errors of the polynomials differ so little from parent to parent that their mean is good to within
  /// `tolerance`, pixels.
  bool parents_agree(std::size_t step, float tolerance) const;

  /// Sets the samples that are not traced, in each quarter where they can be predicted to within `tolerance`, pixels,
  /// if their light may fall on the plate. The test is to predict traced samples of the quarter from every second one:
  /// they must be within `tolerance`. Where landings are smooth, the error of untraced samples is then far less.
  /// @return Whether all samples are known.
  bool predict(std::size_t step, float tolerance);

  /// Whether a sample is in a quarter that is not predicted yet.
  bool is_open(std::size_t sample) const;

 private:
  bool landed(std::size_t sample) const { return ends_[sample] == RayEnd::plate; }
  bool is_on_plate(std::size_t sample) const;
  bool matters(std::size_t sample, std::size_t step) const;
  bool is_smooth(std::size_t quarter, std::size_t step, float tolerance) const;
  bool parents_agree(std::size_t quarter, std::size_t step, float tolerance) const;
  bool is_smooth_beside_parents(std::size_t quarter, std::size_t step, float tolerance) const;
  Eigen::Vector2f between(std::size_t sample, std::size_t step) const;
  void set(std::size_t quarter, std::size_t step, bool beside_parents);

  Eigen::Vector2f* landings_;
  RayEnd* ends_;
  std::array<const Eigen::Vector2f*, 4> parents_{};
  std::size_t parent_count_ = 0;                     // 0 if some of their light does not land.
  std::array<Eigen::Vector2f, range_samples> mean_;  // Of the parents' landings, if their light lands.
  Eigen::Array2f plate_;
  std::array<bool, 4> is_predicted_{};  // By quarter.
};

}  // namespace tensorray
