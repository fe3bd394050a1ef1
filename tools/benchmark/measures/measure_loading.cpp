#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/files/temporary_folder.h"
#include "tools/benchmark/measures/parts.h"
#include "tools/benchmark/support/repeat.h"
#include "volumes/bricks/tensor_field.h"
#include "volumes/files/tensor_files.h"
#include "volumes/making/generators.h"

namespace tensorray::benchmark {

Json measure_loading(const Options& options, const Json& machine) {
  constexpr double voxel_bytes = 9 * sizeof(float);
  const int resolution = options.quick ? 16 : 256;
  const TemporaryFolder folder;
  const auto path = folder / "field.vdb";
  options.announce("loading: making the file");
  const Generator generator = PointLoad();
  write_tensor_vdb(path, generate(generator, default_grid(generator, resolution)));

  std::array<double, repetitions> opening{}, seconds{};
  double voxels = 0, memory = 0;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    options.announce(fmt::format("loading, {} of {}", i + 1, seconds.size()));
    const double start = wall_seconds();
    const BlockSource blocks = open_tensor_vdb(path);
    opening[i] = wall_seconds() - start;
    const TensorField field(blocks);  // Block by block, as in render jobs.
    seconds[i] = wall_seconds() - start;
    voxels = static_cast<double>(active_voxels(blocks.shapes));
    memory = static_cast<double>(field.memory_bytes());
  }
  const double loading = rate_of(seconds).median, bytes = voxels * voxel_bytes;
  const double moved = (bytes + memory) / loading;  // Bytes read and written, as the triad counts them.
  const double triad = machine.at("memory").back().at("triad_bytes_per_second");
  return {{"field", fmt::format("point load, {}³, from a file that the system has in memory", resolution)},
          {"active_voxels", voxels},
          {"seconds", loading},
          {"seconds_opening", rate_of(opening).median},
          {"bytes_per_second", bytes / loading},
          {"moved_bytes_per_second", moved},
          {"bandwidth_fraction", moved / triad},
          {"memory_bytes", memory},
          {"memory_ratio", memory / bytes}};
}

}  // namespace tensorray::benchmark
