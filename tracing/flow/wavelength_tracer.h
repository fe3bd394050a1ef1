#pragma once
/// Landings of light of one vertex at all its wavelength samples: some are traced, the others predicted.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "tracing/bending/bending.h"
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

/// The place, on the plane of `plate`, of a point where light lands. A body's point is projected from the beam's
/// source. Parallel light needs no projection: the pixel of a point is that of its projection along the plate's normal.
Eigen::Vector3d place_on(const Plate& plate, const Geometry& geometry, const Beam& beam, const Eigen::Vector3d& point);

/// A vertex whose light is to be traced.
struct NewVertex {
  std::size_t index;  ///< In the map.
  Eigen::Vector3d origin;
  Parents parents;
};

/// Traces as few wavelength samples as the smoothness of the landings allows, and predicts the others. Any number of
/// threads may use it at once.
class WavelengthTracer {
 public:
  /// @param settings  With a plate.
  WavelengthTracer(const TensorField& field, const Geometry& geometry, const Beam& beam, const BendingSettings& bending,
                   const FlowSettings& settings);

  std::size_t wavelengths() const { return flexibilities_.size(); }

  /// At every so many wavelength samples there are lengths.
  std::size_t check_step() const { return is_range_ ? first_step : 1; }

  /// Sets landings, ends and lengths of the vertices, for which the map has room. Different vertices may be traced at
  /// once; their parents must be traced already.
  void trace(FlowMap& map, const std::vector<NewVertex>& vertices);

  std::uint64_t rays() const { return rays_; }
  std::uint64_t ray_steps() const { return ray_steps_; }
  std::uint64_t tensor_samples() const { return tensor_samples_; }

 private:
  static constexpr std::size_t first_step = 8;      // 5 samples come first, ...
  static constexpr std::size_t coarsest_step = 16;  // ... or 3, where the parents agree in what is between them.

  struct SampleRay {
    std::size_t vertex, sample;  // The vertex is a number of a new one.
  };
  /// A vertex of which every `step`-th sample is traced next.
  struct PartlyTraced {
    std::size_t vertex, step;
    WavelengthPrediction prediction;
  };

  struct Body {
    Geometry alone;
    double off;  // Distance from its surface at which it is looked for.
  };

  void trace_rays(FlowMap& map, const std::vector<NewVertex>& vertices, const std::vector<SampleRay>& rays);
  void predict_lengths(FlowMap& map, std::size_t vertex, const Parents& parents) const;
  RayEnd end_of(const RayBatch& rays, std::size_t ray, const Eigen::Vector3d& origin) const;

  const TensorField& field_;
  const Geometry& geometry_;
  const Plate plate_;
  const Beam& beam_;
  const BendingSettings& bending_;
  std::shared_ptr<RayMemory> memory_;  // Null: rays are not remembered.
  std::optional<Geometry> volume_;     // With `memory_`: the geometry without its plate.
  std::optional<Body> body_;           // If it collects the light.
  std::optional<SideFaces> sides_;     // If light that leaves through them does not count.
  float tolerance_;                    // Of predicted landings, pixels.
  bool is_range_;
  std::vector<double> flexibilities_;  // One for each wavelength sample.
  std::atomic<std::uint64_t> rays_{0}, ray_steps_{0}, tensor_samples_{0};
};

}  // namespace tensorray
