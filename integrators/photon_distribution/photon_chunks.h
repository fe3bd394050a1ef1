#pragma once
/// Traces photons in chunks of positions. What a chunk gives is a function of its number alone.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <tbb/enumerable_thread_specific.h>

#include "base/process/archive.h"
#include "base/process/progress.h"
#include "integrators/photon_distribution/fluence.h"
#include "integrators/photon_distribution/photon_distribution.h"
#include "renderer/density/density.h"
#include "renderer/film/film.h"
#include "renderer/lights/beam.h"
#include "tracing/bending/bending.h"
#include "tracing/bending/geometry.h"
#include "volumes/bricks/tensor_field.h"

namespace tensorray {

/// Maps world positions to pixels of a plate.
struct PixelMap {
  Eigen::Matrix<double, 2, 3> linear;
  Eigen::Vector2d offset, size;

  explicit PixelMap(const Plate& plate);

  /// Clamps the result: rounding may move a hit on the plate's edge off the plate.
  Eigen::Vector2d operator()(const Eigen::Vector3d& world) const {
    return (linear * world + offset).cwiseMax(0).cwiseMin(size);
  }
};

/// What all chunks share and do not change.
struct PhotonJob {
  const TensorField& field;
  const Geometry& geometry;
  const Beam& beam;
  const std::vector<LightChannel>& channels;
  const PhotonSettings& settings;
  const Progress& progress;
  const BeamSampler positions;
  const PixelMap to_pixel;
  int rays_per_position = 0;
  int channels_per_ray = 0;  ///< A ray carries one of this number of channels.
  double ray_area = 0;
  std::optional<SideFaces> sides = {};  ///< If light that leaves through them does not count.

  std::uint64_t chunk_size() const;  ///< Positions of a chunk; the last one may have fewer.
  std::uint64_t chunks() const { return (positions.candidates() + chunk_size() - 1) / chunk_size(); }
};

/// What photons give together. Sums of some chunks of photons can be added to those of others: the result does not
/// depend on the order, nor on which process has traced which chunk.
struct PhotonSums {
  std::uint64_t candidates = 0;  ///< Of the beam (BeamSampler), whether they emitted or not.
  std::uint64_t ray_steps = 0, tensor_samples = 0;
  std::vector<std::uint64_t> emitted;       ///< Rays, by channel, ...
  std::vector<EndCounts> ends;              ///< ... and by their ends.
  std::optional<DensityEstimator> density;  ///< The light on the plate.
  std::unique_ptr<FluenceSums> fluence;     ///< Null: not wanted.
  bool is_colored = false;                  ///< Whether the light on the plate is red, green and blue, not by channel.
  bool has_photons = false;                 ///< Whether photons are wanted.
  std::map<std::uint64_t, std::vector<PlatePhoton>> photons;  ///< By the number of their chunk.
};

/// Writes the sums, or adds those of other photons. What these sums do not want is left out.
/// @throw DamagedArchive if they are those of other light, or have not all that is wanted.
void copy_sums(Archive& archive, PhotonSums& sums);

/// Sums for photons of the job, without any photons.
PhotonSums empty_sums(const PhotonJob& job);

class ChunkTracer {
 public:
  /// `job` must outlive it.
  explicit ChunkTracer(const PhotonJob& job) : job_(job) {}

  /// Traces a chunk, and adds what it gives to `sums`. Runs on all threads. Only the calling thread reports progress.
  /// @throw Cancelled.
  void trace(std::uint64_t chunk, PhotonSums& sums);

  double seconds_tracing() const { return seconds_tracing_; }

 private:
  /// The buffers of a thread, and its counts.
  struct Worker {
    RayBatch batch;
    std::vector<RayRecord> records;
    std::vector<std::uint16_t> channels;  // The channel of each ray of the batch.
    std::vector<std::uint64_t> emitted;
    std::vector<EndCounts> ends;
    std::uint64_t ray_steps = 0;
  };

  void trace_rays(std::uint64_t chunk, PhotonSums& sums);
  void trace_task(std::size_t task, PhotonSums& sums);
  void fill_batch(std::size_t begin, std::size_t end, Worker& worker) const;
  void trace_batch(Worker& worker, PhotonSums& sums) const;
  void collect_batch(Worker& worker, PhotonSums& sums) const;
  void take_counts(PhotonSums& sums);

  const PhotonJob& job_;
  tbb::enumerable_thread_specific<Worker> workers_;
  std::vector<Emission> emissions_;                // Of the chunk, ordered along a Morton curve.
  std::vector<std::vector<PlatePhoton>> photons_;  // One list for each task, if photons are kept.
  double seconds_tracing_ = 0;
};

}  // namespace tensorray
