#pragma once
/// @file tools/benchmark/workload.h
/// What is measured on: fields, and the packets of rays that go through them. The same for every kernel.

#include <cstdint>
#include <string>
#include <vector>

#include "integrators/bending/bending.h"
#include "renderer/surfaces/geometry.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/tensors/generators.h"

namespace tensorray::benchmark {

constexpr double step = 0.5;     ///< Of every kernel, in voxels.
constexpr int packet_rays = 32;  ///< Wavelengths of one origin.

/// A field in the forms that kernels are made of. Voxels are cubes.
struct TestField {
  TensorGrid grid;
  TensorField field;
  Geometry geometry;          ///< The field's bounds, and nothing else: rays end where they leave them.
  Eigen::Vector3d direction;  ///< Of the light; unit.

  double voxel() const { return grid.to_world.linear().col(0).norm(); }  ///< World units.
};

struct FieldRequest {
  Generator generator;
  int resolution = 128;
  Eigen::Vector3d direction;  ///< Of the light.
  double turn = 0.15;         ///< Radians by which the median ray turns at s = 0.2, roughly: the field's scale.
  bool half_empty = false;    ///< Without every second cube of 64³ voxels (16³ where `resolution` is below 128).
};

TestField make_field(const FieldRequest& request);

/// How packets follow each other.
enum class Order {
  warm,   ///< 64 origins side by side, over and over: cells are in the cache.
  fresh,  ///< All over the face where light enters, in no order.
};

/// The packets `first`, `first` + 1, ... in batches as the renderer's own: rays begin on the face where light enters.
std::vector<RayBatch> make_batches(const TestField& test, Order order, std::uint64_t first, std::uint64_t packets);

}  // namespace tensorray::benchmark
