#include "integrators/probes/stretch.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include "base/process/kept_results.h"
#include "base/process/team.h"
#include "integrators/tracing/trace.h"

namespace tensorray {
namespace {

constexpr std::size_t stretch_chunk = 64;  // Blocks, or rows, between two progress reports.

/// ln of the greatest singular value.
double log_stretch(const Eigen::Matrix<double, 3, 2>& m) {
  const Eigen::Matrix2d square = m.transpose() * m;
  const double mean = square.trace() / 2;
  const double greatest = mean + std::hypot((square(0, 0) - square(1, 1)) / 2, square(0, 1));
  return std::log(std::max(greatest, std::numeric_limits<double>::min())) / 2;
}

/// Parts of a result, each of so many numbers, that are computed on their own.
struct StretchParts {
  std::size_t count, size;
  std::uint64_t hash;                              // Of what they depend on.
  std::function<float*(std::size_t part)> values;  // Where its numbers are.
  std::function<void(std::size_t part)> compute;   // Sets them.
  std::function<void()> show = {};                 // Called from time to time; may be empty.
};

/// Computes parts on all threads, or takes them from those that were kept.
class StretchComputer {
 public:
  StretchComputer(StretchParts parts, const StretchSettings& settings)
      : parts_(std::move(parts)), team_(settings.team), kept_(settings.kept) {}

  void run(const Progress& progress) {
    for (std::size_t first = 0; first < parts_.count; first += stretch_chunk) {
      progress.update("tracing rays", first, parts_.count);
      if (kept_ && (progress.cancelled || kept_->is_due())) keep(first);
      if (first > 0 && parts_.show) parts_.show();
      const std::size_t last = std::min(first + stretch_chunk, parts_.count);
      tbb::parallel_for(first, last, [&](std::size_t part) {
        if (progress.cancelled) throw Cancelled();
        if (is_mine(part) && !restore(part)) parts_.compute(part);
      });
    }
    if (kept_ && kept_->is_shard()) keep(parts_.count);
    if (team_)
      collect_parts(*team_, parts_.count, std::max<std::size_t>(1, floats_at_once / parts_.size),
                    [&](std::size_t part, PartBytes& bytes) { copy(part, bytes); });
    progress.update("tracing rays", parts_.count, parts_.count);
  }

 private:
  static constexpr std::size_t floats_at_once = std::size_t{1} << 24;  // In a message between processes.

  std::size_t bytes() const { return parts_.size * sizeof(float); }
  ResultKey key(std::size_t part) const { return {part, parts_.size, parts_.hash}; }
  void copy(std::size_t part, PartBytes& bytes_of_part) { bytes_of_part.copy(parts_.values(part), bytes()); }

  bool is_mine(std::size_t part) const {
    return does_part(team_, part) && (!kept_ || part % kept_->part().count == kept_->part().index);
  }

  bool restore(std::size_t part) {
    std::optional<std::string> values = kept_ ? kept_->find(key(part), bytes()) : std::nullopt;
    if (!values) return false;
    PartBytes from(std::move(*values));
    copy(part, from);
    return true;
  }

  /// Keeps the parts up to `last` that this process has.
  void keep(std::size_t last) {
    for (; added_ < last; ++added_) {
      if (!is_mine(added_)) continue;
      PartBytes to;
      copy(added_, to);
      kept_->add(key(added_), to.take());
    }
    kept_->keep(false);
  }

  StretchParts parts_;
  Team* team_;
  KeptResults* kept_;
  std::size_t added_ = 0;
};

/// @param more  What the numbers depend on, beside the settings.
std::uint64_t hash_of_stretch(const StretchSettings& settings, const std::vector<double>& more) {
  const double numbers[] = {settings.direction.x(), settings.direction.y(), settings.direction.z(),
                            settings.flexibility, settings.length};
  return hash_of(more.data(), more.size() * sizeof more[0], hash_of(numbers, sizeof numbers));
}

constexpr double most_voxels = 1 << 30;

/// A lattice in the volume, with the same centre as the extent.
struct Lattice {
  Eigen::Vector3i size;
  Eigen::Affine3d to_world;
};

Lattice make_lattice(const TensorField& field, int resolution) {
  if (resolution < 2) throw std::invalid_argument("the resolution must be 2 or more");
  const Eigen::AlignedBox3d& extent = field.index_bounds();
  const double spacing = extent.sizes().maxCoeff() / (resolution - 1);
  Lattice lattice;
  lattice.size = (extent.sizes() / spacing + Eigen::Vector3d::Constant(1e-6)).array().floor().cast<int>() + 1;
  if (lattice.size.cast<double>().prod() > most_voxels)
    throw std::invalid_argument("the grid would have more than 2^30 voxels: lower the resolution");
  const Eigen::Vector3d first = extent.center() - spacing / 2 * (lattice.size.cast<double>() - Eigen::Vector3d::Ones());
  lattice.to_world = field.to_world() * Eigen::Translation3d(first) * Eigen::Scaling(spacing);
  return lattice;
}

/// All blocks of a lattice, in order.
std::deque<ScalarBlock> blocks_of(const Lattice& lattice) {
  constexpr int size = TensorBlock::size;
  std::deque<ScalarBlock> blocks;
  for (int x = 0; x < lattice.size.x(); x += size)
    for (int y = 0; y < lattice.size.y(); y += size)
      for (int z = 0; z < lattice.size.z(); z += size) {
        blocks.emplace_back();
        blocks.back().origin = {x, y, z};
      }
  return blocks;
}

}  // namespace

std::vector<float> stretches(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                             const StretchSettings& settings, const std::vector<Eigen::Vector3d>& starts) {
  if (!std::isfinite(settings.length)) throw std::invalid_argument("the length of the rays must be finite");
  BendingSettings limited = bending;
  limited.max_length = settings.length;
  RayDifferential across;
  across.position.col(0) = settings.direction.unitOrthogonal();
  across.position.col(1) = settings.direction.cross(across.position.col(0));
  RayBatch batch;
  for (const Eigen::Vector3d& start : starts) {
    batch.add(start, settings.direction, settings.flexibility);
    batch.differentials.push_back(across);
  }
  trace(field, geometry, limited, batch);

  std::vector<float> values(starts.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (batch.end[i] != RayEnd::missed || batch.steps[i] == 0) continue;
    const RayDifferential& end = batch.differentials[i];
    values[i] = static_cast<float>(log_stretch(end.position - batch.direction[i] * end.length) / settings.length);
  }
  return values;
}

ScalarGrid stretch_grid(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                        const StretchSettings& settings, int resolution, const Progress& progress) {
  const Lattice lattice = make_lattice(field, resolution);
  ScalarGrid grid;
  grid.name = "stretch";
  grid.to_world = lattice.to_world;
  grid.blocks = blocks_of(lattice);
  const auto compute = [&](std::size_t i) {
    ScalarBlock& block = grid.blocks[i];
    std::vector<Eigen::Vector3d> starts;
    std::vector<int> offsets;
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      const Eigen::Vector3i voxel = block.origin + TensorBlock::position(offset);
      if ((voxel.array() >= lattice.size.array()).any()) continue;
      starts.push_back(lattice.to_world * voxel.cast<double>());
      offsets.push_back(offset);
    }
    const std::vector<float> values = stretches(field, geometry, bending, settings, starts);
    for (std::size_t k = 0; k < values.size(); ++k) block.values[offsets[k]] = values[k];
  };
  for (ScalarBlock& block : grid.blocks) block.values.fill(std::numeric_limits<float>::quiet_NaN());
  StretchParts parts{grid.blocks.size(), TensorBlock::voxels,
                     hash_of_stretch(settings, {static_cast<double>(resolution)}),
                     [&](std::size_t i) { return grid.blocks[i].values.data(); }, compute};
  StretchComputer(std::move(parts), settings).run(progress);
  for (ScalarBlock& block : grid.blocks)
    for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
      float& value = block.values[offset];
      if (std::isnan(value))
        value = 0;
      else
        block.active.set(offset);
    }
  grid.blocks.erase(std::remove_if(grid.blocks.begin(), grid.blocks.end(),
                                   [](const ScalarBlock& block) { return block.active.none(); }),
                    grid.blocks.end());
  return grid;
}

std::vector<float> stretch_picture(const TensorField& field, const Geometry& geometry, const BendingSettings& bending,
                                   const StretchSettings& settings, const Plate& pixels, const Progress& progress) {
  const auto width = static_cast<std::size_t>(pixels.resolution.x());
  const auto height = static_cast<std::size_t>(pixels.resolution.y());
  std::vector<float> picture(width * height, std::numeric_limits<float>::quiet_NaN());
  const auto compute = [&](std::size_t y) {
    std::vector<Eigen::Vector3d> starts;
    for (std::size_t x = 0; x < width; ++x)
      starts.push_back(pixels.to_world(Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5)));
    const std::vector<float> row = stretches(field, geometry, bending, settings, starts);
    std::copy(row.begin(), row.end(), picture.begin() + static_cast<std::ptrdiff_t>(y * width));
  };
  const Eigen::Vector3d corner = pixels.to_world({0, 0}), opposite = pixels.to_world(pixels.resolution.cast<double>());
  StretchParts parts{height, width,
                     hash_of_stretch(settings, {corner.x(), corner.y(), corner.z(), opposite.x(), opposite.y(),
                                                opposite.z(), static_cast<double>(height)}),
                     [&](std::size_t y) { return &picture[y * width]; }, compute};
  if (settings.show) parts.show = [&] { settings.show(picture); };
  StretchComputer(std::move(parts), settings).run(progress);
  return picture;
}

}  // namespace tensorray
