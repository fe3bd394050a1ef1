#include <memory>

#include <openvdb/tools/Interpolation.h>

#include "tools/benchmark/kernels/kernels.h"
#include "tools/benchmark/kernels/openvdb_grids.h"
#include "tools/benchmark/kernels/plain_tracer.h"

namespace tensorray::benchmark {
namespace {

using MatrixTree = openvdb::tree::Tree4<openvdb::math::Mat3s, 5, 4, 3>::Type;
using MatrixGrid = openvdb::Grid<MatrixTree>;
using RowMajor = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;

TraceFunction rows_tracer(const TestField& test) {
  const auto rows = make_openvdb_rows(test.grid);
  return [&test, rows](RayBatch& batch) {
    auto x = rows[0]->getConstAccessor(), y = rows[1]->getConstAccessor(), z = rows[2]->getConstAccessor();
    const auto sample = [&](const Eigen::Vector3f& at) {
      const openvdb::Vec3R position(at.x(), at.y(), at.z());
      Eigen::Matrix3f T;
      const openvdb::Vec3s row_x = openvdb::tools::BoxSampler::sample(x, position),
                           row_y = openvdb::tools::BoxSampler::sample(y, position),
                           row_z = openvdb::tools::BoxSampler::sample(z, position);
      T << row_x[0], row_x[1], row_x[2], row_y[0], row_y[1], row_y[2], row_z[0], row_z[1], row_z[2];
      return T;
    };
    trace_plainly(test, sample, batch);
  };
}

TraceFunction matrix_tracer(const TestField& test) {
  const MatrixGrid::Ptr grid = make_openvdb_grid<MatrixGrid>(test.grid, [](const Eigen::Matrix3f& T) {
    return openvdb::math::Mat3s(T(0, 0), T(0, 1), T(0, 2), T(1, 0), T(1, 1), T(1, 2), T(2, 0), T(2, 1), T(2, 2));
  });
  return [&test, grid](RayBatch& batch) {
    auto accessor = grid->getConstAccessor();
    const auto sample = [&](const Eigen::Vector3f& at) -> Eigen::Matrix3f {
      const auto T = openvdb::tools::BoxSampler::sample(accessor, openvdb::Vec3R(at.x(), at.y(), at.z()));
      return Eigen::Map<const RowMajor>(T.asPointer());
    };
    trace_plainly(test, sample, batch);
  };
}

}  // namespace

Kernel openvdb_rows_kernel() {
  Kernel kernel;
  kernel.name = "OpenVDB, three Vec3S rows, BoxSampler";
  kernel.make = rows_tracer;
  return kernel;
}

Kernel openvdb_matrix_kernel() {
  Kernel kernel;
  kernel.name = "OpenVDB, one Mat3s grid, BoxSampler";
  kernel.make = matrix_tracer;
  return kernel;
}

}  // namespace tensorray::benchmark
