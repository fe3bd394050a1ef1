#pragma once
/// @file tools/benchmark/kernels/workload.h
/// The fields and the packets of rays of the measurements. They are the same for every kernel.

#include <cstdint>
#include <string>
#include <vector>

#include "integrators/bending/bending.h"
#include "integrators/bending/geometry.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/making/generators.h"

namespace tensorray::benchmark {

constexpr double step = 0.5;     ///< Step of the kernels, in voxels.
constexpr int packet_rays = 32;  ///< Rays of one origin, one for each wavelength.

/// A field in the forms from which kernels are made. Voxels are cubes.
struct TestField {
  TensorGrid grid;
  TensorField field;
  Geometry geometry;          ///< Only the bounds of the field: rays end where they leave them.
  Eigen::Vector3d direction;  ///< Direction of the light, of unit length.

  double voxel() const { return grid.to_world.linear().col(0).norm(); }  ///< Edge of a voxel, world units.
};

struct FieldRequest {
  Generator generator;
  int resolution = 128;
  Eigen::Vector3d direction;  ///< Direction of the light, of any length.
  double turn = 0.15;         ///< Approximate turn of the median ray at s = 0.2, radians. It sets the field's scale.
  bool half_empty = false;    ///< Remove every second cube of 64³ voxels (16³ where `resolution` is below 128).
};

TestField make_field(const FieldRequest& request);

/// The order of the packets' origins.
enum class Order {
  warm,    ///< 64 neighbouring origins, repeated: their cells are in the cache.
  fresh,   ///< All over the face where light enters, in a shuffled order.
  morton,  ///< As photon jobs trace them: squares of 32² neighbouring origins of 256² on the face, each along a Morton
           ///< curve. The order of the squares is shuffled, so that few packets see all of the field.
  dense,  ///< The same, of 1024² origins.
};

/// The packets `first`, `first` + 1, ... in batches like those of the renderer. Rays begin on the face where light
/// enters.
std::vector<RayBatch> make_batches(const TestField& test, Order order, std::uint64_t first, std::uint64_t packets);

}  // namespace tensorray::benchmark
