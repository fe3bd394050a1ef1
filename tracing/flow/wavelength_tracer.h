#pragma once
/// Landings of light of one vertex at all its wavelength samples: some are traced, the others predicted.

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "tracing/bending/bending.h"
#include "tracing/flow/flow_map.h"

namespace tensorray {

constexpr std::size_t range_samples = 33;  // Wavelength samples of a range.

/// The landings of a vertex at all samples, of which as few are traced as their smoothness allows.
///
/// A polynomial through the nearest traced samples predicts the others: a cubic through four, if there are as many. Of
/// a gap between traced samples, the middle is traced. If its prediction was good, both halves are predicted; otherwise
/// they are gaps, too. Thus all samples are needed only near a kink. A gap of which the light of one side alone lands
/// is bisected.
class WavelengthPrediction {
 public:
  /// @param plate      Width and height of the plate, pixels.
  /// @param tolerance  Of the prediction of middles, pixels. Where landings are smooth, those of halves are far better.
  WavelengthPrediction(FlowMap& map, std::size_t vertex, const Eigen::Array2f& plate, float tolerance);

  /// The samples to trace next; the first time, five. If there are none, all landings are set.
  const std::vector<int>& wanted() const { return wanted_; }
  void go_on();  ///< Call it when these are traced.

 private:
  struct Gap {
    int from, to;
    int middle() const { return (from + to) / 2; }
  };

  bool landed(int sample) const { return ends_[sample] == RayEnd::plate; }
  bool is_on_plate(int sample) const;
  Eigen::Vector2f predicted(int sample) const;
  void divide(std::vector<Gap> gaps);
  void predict_rest();

  Eigen::Vector2f* landings_;
  RayEnd* ends_;
  Eigen::Array2f plate_;
  float tolerance_;
  std::array<bool, range_samples> is_traced_{};
  std::vector<Gap> open_;  // Whose middles are traced next.
  std::vector<int> wanted_;
};

/// The place, on the plane of `plate`, of a point where light lands. A body's point is projected from the beam's
/// source. Parallel light needs no projection: the pixel of a point is that of its projection along the plate's normal.
Eigen::Vector3d place_on(const Plate& plate, const Geometry& geometry, const Beam& beam, const Eigen::Vector3d& point);

/// A vertex whose light is to be traced.
struct NewVertex {
  std::size_t index;  ///< In the map.
  Eigen::Vector3d origin;
};

/// Traces as few wavelength samples as the smoothness of the landings allows, and predicts the others. Any number of
/// threads may use it at once.
class WavelengthTracer {
 public:
  /// @param settings  With a plate.
  WavelengthTracer(const TensorField& field, const Geometry& geometry, const Beam& beam, const BendingSettings& bending,
                   const FlowSettings& settings);

  std::size_t wavelengths() const { return flexibilities_.size(); }

  /// At every so many wavelength samples there are lengths; in a range, those are traced first.
  std::size_t check_step() const { return is_range_ ? (range_samples - 1) / 4 : 1; }

  /// Sets landings, ends and lengths of the vertices, for which the map has room. Different ones may be traced at once.
  void trace(FlowMap& map, const std::vector<NewVertex>& vertices);

  std::uint64_t rays() const { return rays_; }
  std::uint64_t ray_steps() const { return ray_steps_; }
  std::uint64_t tensor_samples() const { return tensor_samples_; }

 private:
  struct SampleRay {
    std::size_t vertex, sample;  // The vertex is a number of a new one.
  };
  struct PartlyTraced {
    std::size_t vertex;
    WavelengthPrediction prediction;
  };

  struct Body {
    Geometry alone;
    double off;  // Distance from its surface at which it is looked for.
  };

  void trace_rays(FlowMap& map, const std::vector<NewVertex>& vertices, const std::vector<SampleRay>& rays);
  RayEnd end_of(const RayBatch& rays, std::size_t ray, const Eigen::Vector3d& origin) const;

  const TensorField& field_;
  const Geometry& geometry_;
  const Plate plate_;
  const Beam& beam_;
  const BendingSettings& bending_;
  std::optional<Body> body_;        // If it collects the light.
  std::optional<SideFaces> sides_;  // If light that leaves through them does not count.
  float tolerance_;                 // Of predicted landings, pixels.
  bool is_range_;
  std::vector<double> flexibilities_;  // One for each wavelength sample.
  std::atomic<std::uint64_t> rays_{0}, ray_steps_{0}, tensor_samples_{0};
};

}  // namespace tensorray
