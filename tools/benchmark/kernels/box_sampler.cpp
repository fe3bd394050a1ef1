/// @file tools/benchmark/kernels/box_sampler.cpp
/// For comparison: `tensorray` with OpenVDB's BoxSampler instead of bricks, and without packets. This file replaces two
/// source files, and keeps the contracts of their headers as far as tracing photons needs them. It replaces
/// volumes/sampling/tensor_sampler.cpp with a TensorSampler on three OpenVDB grids, one for each row of the tensor. It
/// replaces integrators/tracing/packet_tracer.cpp with a `trace_in_packets` that leaves every ray to the scalar tracer.
/// CMakeLists.txt links all other objects of `tensorray` with this one; a missing or a second definition is an error of
/// the linker. Except for sampling and packets, both programs therefore run the same machine code.

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>

#include <openvdb/tools/Interpolation.h>

#include "integrators/tracing/packet_tracer.h"
#include "tools/benchmark/kernels/openvdb_grids.h"
#include "volumes/sampling/tensor_sampler.h"

namespace tensorray {
namespace {

using Rows = std::array<openvdb::Vec3SGrid::Ptr, 3>;

/// A grid with the voxels of the field's bricks as blocks.
TensorGrid grid_of(const TensorField& field) {
  TensorGrid grid;
  grid.to_world = field.to_world();
  const Eigen::Vector3i first = (field.voxels().min() / TensorBrick::cells).array().floor().cast<int>(),
                        last = (field.voxels().max() / TensorBrick::cells).array().floor().cast<int>();
  for (int x = first.x(); x <= last.x(); ++x)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int z = first.z(); z <= last.z(); ++z) {
        if (!field.is_stored({x, y, z})) continue;
        const TensorBrick brick = field.brick({x, y, z});
        TensorBlock& block = grid.blocks.emplace_back();
        block.origin = TensorBlock::size * Eigen::Vector3i(x, y, z);
        block.active.set();
        for (int offset = 0; offset < TensorBlock::voxels; ++offset) {
          const Eigen::Vector3i at = TensorBlock::position(offset);
          block.values[offset] = brick.tensor(TensorBrick::voxel(at.x(), at.y(), at.z())).cast<float>();
        }
      }
  return grid;
}

/// Identifies a field by the address of its first brick and by that brick's `strongest`, because a new field may reuse
/// the memory of another.
struct FieldKey {
  const float* floats = nullptr;
  float strongest = 0;

  bool operator==(const FieldKey& other) const { return floats == other.floats && strongest == other.strongest; }
};

FieldKey key_of(const TensorField& field) {
  const Eigen::Vector3i first = (field.voxels().min() / TensorBrick::cells).array().floor().cast<int>();
  const TensorBrick brick = field.brick(first);
  return {brick.bending, brick.strongest};
}

/// The grids of the field that was requested last. All threads share them.
Rows shared_rows(const TensorField& field, const FieldKey& key) {
  static std::mutex mutex;
  static FieldKey made;
  static Rows& rows = *new Rows;  // Never destroyed: OpenVDB would use threads, which have ended by then.
  const std::lock_guard<std::mutex> lock(mutex);
  if (!(made == key)) {
    rows = benchmark::make_openvdb_rows(grid_of(field));
    made = key;
  }
  return rows;
}

/// The accessors of one thread. They are not registered with the grids, because threads end after the grids do.
struct View {
  explicit View(const TensorField& field) : key(key_of(field)), rows(shared_rows(field, key)) {}

  FieldKey key;
  Rows rows;
  std::array<openvdb::Vec3SGrid::ConstUnsafeAccessor, 3> accessors{
      rows[0]->getConstUnsafeAccessor(), rows[1]->getConstUnsafeAccessor(), rows[2]->getConstUnsafeAccessor()};
};

thread_local std::optional<View> view;  // Of the field that this thread samples.

void look_at(const TensorField& field) {
  if (!view || !(view->key == key_of(field))) view.emplace(field);
}

}  // namespace

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d& world) {
  if (samples_++ == 0) look_at(*field_);  // Once per sampler: a thread uses its samplers one after another.
  const Eigen::AlignedBox3d& voxels = field_->voxels();
  const Eigen::Vector3d index = (field_->to_index() * world).cwiseMax(voxels.min()).cwiseMin(voxels.max());
  Eigen::Matrix3d T;
  for (int row = 0; row < 3; ++row) {
    const openvdb::Vec3s value =
        openvdb::tools::BoxSampler::sample(view->accessors[row], openvdb::Vec3R(index.x(), index.y(), index.z()));
    T.row(row) << value[0], value[1], value[2];
  }
  return T;
}

Eigen::Matrix3d TensorSampler::at(const Eigen::Vector3d&, const Eigen::Matrix<double, 3, 2>&,
                                  std::array<Eigen::Matrix3d, 2>&) {
  throw std::invalid_argument("tensorray_box_sampler cannot trace derivatives; use it for photon_distribution only");
}

double TensorSampler::way_through_straight_brick(const Eigen::Vector3d&, const Eigen::Vector3d&) { return 0; }

bool trace_in_packets(const TensorField&, const Geometry&, const BendingSettings&, RayBatch&, RayRecord*) {
  return false;
}

}  // namespace tensorray
