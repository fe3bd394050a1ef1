#include "tools/benchmark/kernels/kernels.h"

#ifdef TENSORRAY_HAS_NANOVDB

#include <array>
#include <memory>

#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/SampleFromVoxels.h>

#include "tools/benchmark/kernels/openvdb_grids.h"
#include "tools/benchmark/kernels/plain_tracer.h"

namespace tensorray::benchmark {
namespace {

using Handles = std::array<nanovdb::GridHandle<nanovdb::HostBuffer>, 3>;

TraceFunction rows_tracer(const TestField& test) {
  const auto rows = make_openvdb_rows(test.grid);
  const auto handles = std::make_shared<Handles>();
  for (int row = 0; row < 3; ++row)
    (*handles)[row] =
        nanovdb::openToNanoVDB(*rows[row], nanovdb::StatsMode::Disable, nanovdb::ChecksumMode::Disable, 0);
  return [&test, handles](RayBatch& batch) {
    const auto accessor = [&](int row) { return (*handles)[row].grid<nanovdb::Vec3f>()->getAccessor(); };
    const auto x = accessor(0), y = accessor(1), z = accessor(2);
    const auto sampler_x = nanovdb::createSampler<1>(x), sampler_y = nanovdb::createSampler<1>(y),
               sampler_z = nanovdb::createSampler<1>(z);
    const auto sample = [&](const Eigen::Vector3f& at) {
      const nanovdb::Vec3f position(at.x(), at.y(), at.z());
      const nanovdb::Vec3f row_x = sampler_x(position), row_y = sampler_y(position), row_z = sampler_z(position);
      Eigen::Matrix3f T;
      T << row_x[0], row_x[1], row_x[2], row_y[0], row_y[1], row_y[2], row_z[0], row_z[1], row_z[2];
      return T;
    };
    trace_plainly(test, sample, batch);
  };
}

}  // namespace

Kernel nanovdb_rows_kernel() {
  Kernel kernel;
  kernel.name = "NanoVDB, three Vec3f grids";
  kernel.make = rows_tracer;
  return kernel;
}

}  // namespace tensorray::benchmark

#else

namespace tensorray::benchmark {

Kernel nanovdb_rows_kernel() {
  Kernel kernel;
  kernel.name = "NanoVDB, three Vec3f grids";
  kernel.missing = "not installed";
  return kernel;
}

}  // namespace tensorray::benchmark

#endif
