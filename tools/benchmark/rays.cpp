/// Rays a second of one thread: a loop that a user of OpenVDB's BoxSampler would write, and `trace`, which
/// has cubic fields and steps of order four, also with the same voxels as a second level.

#include <array>
#include <map>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <openvdb/tools/Interpolation.h>

#include "renderer/meshes/mesh.h"
#include "tools/benchmark/questions.h"
#include "tracing/trace/trace.h"
#include "volumes/making/generators.h"
#include "volumes/vdb/vdb_archive.h"

namespace tensorray::bench {
namespace {

constexpr double step = 0.5;                                     // Of the loop, voxels.
constexpr int resolution = 128, wavelengths = 32, origins = 32;  // Origins along an edge of a square.

/// A field, and the square across its face from which light starts: packets of all wavelengths from each origin.
struct Case {
  const char* name;
  Generator generator;
  Eigen::Vector3d direction;
  double scale;  ///< Of the generator's tensors.
  double part;   ///< Edge of the square, as a part of the face.
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all{
      // The wavelengths of a packet part by a tenth of a voxel; origins are side by side.
      {"coherent", PointLoad(), {0.1, 0.07, -1}, 0.033, 0.1},
      // The automatic scale.
      {"as_rendered", PointLoad(), {0.1, 0.07, -1}, 4.9, 1},
      // Ten times the automatic scale.
      {"diverging", Vortex(), {-1, 0.1, 0.05}, 5.5, 1},
  };
  return all;
}

struct Rays {
  TensorGrid grid;
  Geometry geometry;
  TensorField linear, cubic, levels;
  std::vector<RayBatch> batches;
};

/// The voxels as level 1, refined everywhere, and every second one of them along each axis as level 0.
TensorGrid two_levels(const TensorGrid& grid) {
  std::map<std::array<int, 3>, TensorBlock> coarse;  // In the order of their origins.
  for (const TensorBlock& block : grid.blocks)
    for (int i = 0; i < TensorBlock::voxels; ++i) {
      const Eigen::Vector3i fine = block.origin + TensorBlock::position(i), index = fine / 2;
      if (!block.active[i] || fine != 2 * index) continue;
      const Eigen::Vector3i at = index.unaryExpr([](int v) { return v & 7; }), origin = index - at;
      TensorBlock& to = coarse[{origin.x(), origin.y(), origin.z()}];
      to.origin = origin;
      to.active.set(TensorBlock::offset(at.x(), at.y(), at.z()));
      to.values[TensorBlock::offset(at.x(), at.y(), at.z())] = block.values[i];
    }
  TensorGrid result;
  result.to_world = grid.to_world * Eigen::Scaling(2.0);
  for (const auto& [origin, block] : coarse) result.blocks.push_back(block);
  result.finer.push_back(grid.blocks);
  return result;
}

std::vector<RayBatch> make_batches(const Case& test, const TensorField& field) {
  constexpr int packets_of_batch = 16;
  constexpr double lowest_s = 0.02, highest_s = 0.37;  // Of 730 and 380 nm.
  const Eigen::AlignedBox3d& box = field.index_bounds();
  int axis = 0;
  test.direction.cwiseAbs().maxCoeff(&axis);
  std::vector<RayBatch> batches(origins * origins / packets_of_batch);
  for (int i = 0; i < origins * origins; ++i) {
    const auto across = [&](int cell) { return 0.55 + test.part * ((cell + 0.41) / origins - 0.5) * 0.9; };
    Eigen::Vector3d fraction;
    fraction[axis] = test.direction[axis] < 0 ? 1 : 0;
    fraction[(axis + 1) % 3] = across(i % origins);
    fraction[(axis + 2) % 3] = across(i / origins);
    const Eigen::Vector3d origin = field.to_world() * (box.min() + fraction.cwiseProduct(box.sizes())).eval();
    for (int ray = 0; ray < wavelengths; ++ray)
      batches[static_cast<std::size_t>(i / packets_of_batch)].add(
          origin, test.direction.normalized(), lowest_s + (highest_s - lowest_s) * ray / (wavelengths - 1));
  }
  return batches;
}

/// Made at its first use, as other questions may be asked alone.
const Rays& rays_of(const Case& test) {
  static std::map<std::string, std::unique_ptr<Rays>> made;
  std::unique_ptr<Rays>& rays = made[test.name];
  if (!rays) {
    TensorGrid grid = generate(test.generator, default_grid(test.generator, resolution));
    for (TensorBlock& block : grid.blocks)
      for (Eigen::Matrix3f& value : block.values) value *= static_cast<float>(test.scale);
    const Interpolant spline{Interpolation::cubic, Border::fade};
    TensorField linear(grid), cubic(grid, spline), levels(two_levels(grid), spline);
    Surfaces surfaces;
    surfaces.bounds = box_mesh(linear.index_bounds(), linear.to_world());
    std::vector<RayBatch> batches = make_batches(test, linear);
    rays.reset(new Rays{std::move(grid), Geometry(std::move(surfaces)), std::move(linear), std::move(cubic),
                        std::move(levels), std::move(batches)});
  }
  return *rays;
}

/// Traces all batches with `follow`, again and again.
template <class Follow>
void measure(benchmark::State& state, const Rays& rays, const Follow& follow) {
  std::uint64_t samples = 0, count = 0;
  for (auto _ : state)
    for (RayBatch batch : rays.batches) {
      follow(batch);
      benchmark::DoNotOptimize(batch.position.data());
      samples += batch.tensor_samples;
      count += batch.size();
    }
  state.counters["rays_per_second"] = {static_cast<double>(count), benchmark::Counter::kIsRate};
  state.counters["samples_per_second"] = {static_cast<double>(samples), benchmark::Counter::kIsRate};
}

using RowGrids = std::array<openvdb::Vec3SGrid::Ptr, 3>;

/// The rows of the tensors, one grid each.
RowGrids make_rows(const TensorGrid& tensors) {
  RowGrids rows;
  for (int row = 0; row < 3; ++row) {
    rows[row] = empty_grid<openvdb::Vec3SGrid>();
    for (const TensorBlock& block : tensors.blocks) {
      auto* leaf = rows[row]->tree().touchLeaf({block.origin.x(), block.origin.y(), block.origin.z()});
      for (int i = 0; i < TensorBlock::voxels; ++i) {
        const Eigen::Matrix3f& T = block.values[i];
        if (block.active[i])
          leaf->setValueOn(static_cast<openvdb::Index>(i), openvdb::Vec3s(T(row, 0), T(row, 1), T(row, 2)));
      }
    }
  }
  return rows;
}

/// Follows rays in index space, in single precision, with steps of splitting and the exponential's series to the second
/// order, until they leave the box.
class OpenVdbLoop {
 public:
  explicit OpenVdbLoop(const Rays& rays)
      : field_(rays.linear),
        rows_(make_rows(rays.grid)),
        kick_(static_cast<float>(step * rays.grid.to_world.linear().col(0).norm())) {}

  void operator()(RayBatch& batch) const {
    auto x = rows_[0]->getConstAccessor(), y = rows_[1]->getConstAccessor(), z = rows_[2]->getConstAccessor();
    const auto row = [](auto& accessor, const Eigen::Vector3f& at) {
      const openvdb::Vec3s value = openvdb::tools::BoxSampler::sample(accessor, openvdb::Vec3R(at.x(), at.y(), at.z()));
      return Eigen::RowVector3f(value[0], value[1], value[2]);
    };
    const Eigen::AlignedBox3f box = field_.index_bounds().cast<float>();
    constexpr auto half = static_cast<float>(step / 2);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      Eigen::Vector3f P = (field_.to_index() * batch.position[i]).cast<float>(), V = batch.direction[i].cast<float>();
      const float kick = kick_ * static_cast<float>(batch.flexibility[i]);
      do {
        P += half * V;
        Eigen::Matrix3f T;
        T << row(x, P), row(y, P), row(z, P);
        const Eigen::Vector3f first = kick * (T * V);
        V = (V + first + 0.5f * kick * (T * first)).normalized();
        P += half * V;
        ++batch.tensor_samples;
      } while (box.contains(P));
      batch.position[i] = field_.to_world() * P.cast<double>();
      batch.direction[i] = V.cast<double>();
    }
  }

 private:
  const TensorField& field_;
  const RowGrids rows_;
  const float kick_;  // Step times the edge of a voxel: s times it, times T, is the exponent of Eq. 5's step.
};

}  // namespace

void add_rays() {
  for (const Case& test : cases()) {
    const std::string name = std::string("rays/") + test.name;
    const auto add = [&](const char* way, const auto& run) {
      benchmark::RegisterBenchmark((name + "/" + way).c_str(), run)->Unit(benchmark::kMillisecond);
    };
    add("openvdb", [&test](benchmark::State& state) {
      const Rays& rays = rays_of(test);
      measure(state, rays, OpenVdbLoop(rays));
    });
    add("default", [&test](benchmark::State& state) {
      const Rays& rays = rays_of(test);
      measure(state, rays, [&](RayBatch& batch) { trace(rays.cubic, rays.geometry, BendingSettings(), batch); });
    });
    add("levels", [&test](benchmark::State& state) {
      const Rays& rays = rays_of(test);
      measure(state, rays, [&](RayBatch& batch) { trace(rays.levels, rays.geometry, BendingSettings(), batch); });
    });
  }
}

}  // namespace tensorray::bench
