#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/temporary_folder.h"
#include "tools/benchmark/parts.h"
#include "tools/benchmark/repeat.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/files/tensor_files.h"
#include "volumes/tensors/generators.h"

namespace tensorray::benchmark {

Json measure_loading(const Options& options, const Json& machine) {
  constexpr double voxel_bytes = 9 * sizeof(float);
  const int resolution = options.quick ? 16 : 256;
  const TemporaryFolder folder;
  const auto path = folder / "field.vdb";
  options.announce("loading: making the file");
  const Generator generator = PointLoad();
  write_tensor_vdb(path, generate(generator, default_grid(generator, resolution)));

  std::array<double, repetitions> reading{}, bricks{};
  double voxels = 0, memory = 0;
  for (std::size_t i = 0; i < reading.size(); ++i) {
    options.announce(fmt::format("loading, {} of {}", i + 1, reading.size()));
    double start = wall_seconds();
    TensorGrid grid = read_tensor_vdb(path);
    reading[i] = wall_seconds() - start;
    voxels = static_cast<double>(grid.active_voxels());
    start = wall_seconds();
    const TensorField field(std::move(grid));  // Moved, as in render jobs.
    bricks[i] = wall_seconds() - start;
    memory = static_cast<double>(field.memory_bytes());
  }
  const double seconds_reading = rate_of(reading).median, seconds_bricks = rate_of(bricks).median;
  const double bytes = voxels * voxel_bytes;
  const double moved = (bytes + memory) / seconds_bricks;  // Bytes read and written, as the triad counts them.
  const double triad = machine.at("memory").back().at("triad_bytes_per_second");
  return {{"field", fmt::format("point load, {}³, from a file that the system has in memory", resolution)},
          {"active_voxels", voxels},
          {"seconds", seconds_reading + seconds_bricks},
          {"seconds_reading", seconds_reading},
          {"seconds_bricks", seconds_bricks},
          {"bytes_per_second", bytes / seconds_bricks},
          {"moved_bytes_per_second", moved},
          {"bytes_per_second_with_reading", bytes / (seconds_reading + seconds_bricks)},
          {"bandwidth_fraction", moved / triad},
          {"memory_bytes", memory},
          {"memory_ratio", memory / bytes}};
}

}  // namespace tensorray::benchmark
