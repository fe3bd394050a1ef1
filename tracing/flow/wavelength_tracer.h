#pragma once
/// @file tracing/flow/wavelength_tracer.h
/// Landings of light of one vertex at all its wavelength samples.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "tracing/bending/side_faces.h"
#include "tracing/flow/flow_map.h"
#include "tracing/flow/wavelength_prediction.h"

namespace tensorray {

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

  /// The wavelength samples at which there are lengths.
  const std::vector<std::size_t>& check_samples() const { return check_samples_; }

  std::size_t check_step() const { return check_samples_.size() > 1 ? check_samples_[1] : 1; }

  /// Sets landings, ends and lengths of the vertices, for which the map has room. Different vertices may be traced at
  /// once; their parents must be traced already.
  void trace(FlowMap& map, const std::vector<NewVertex>& vertices);

  std::uint64_t rays() const { return rays_; }
  std::uint64_t ray_steps() const { return ray_steps_; }
  std::uint64_t tensor_samples() const { return tensor_samples_; }

 private:
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

  static void add_rays(const std::vector<PartlyTraced>& vertices, bool is_first, std::vector<SampleRay>& rays);
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
  std::vector<std::size_t> check_samples_;
  std::atomic<std::uint64_t> rays_{0}, ray_steps_{0}, tensor_samples_{0};
};

}  // namespace tensorray
