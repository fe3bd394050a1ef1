#include "volumes/vdb/voxel_extent.h"

#include <string>

#include "base/errors.h"
#include "base/process/process_limits.h"
#include "base/text/text.h"
#include "volumes/grids/page_memory.h"

namespace tensorray {

void require_extent(const std::filesystem::path& path, const Eigen::Vector3i& min, const Eigen::Vector3i& max) {
  if ((min.array() >= -max_index).all() && (max.array() <= max_index).all()) return;
  fail(path, "has voxels whose indices are beyond " + std::to_string(max_index) +
                 "; the file is damaged, or its grid has to be moved to the origin");
}

void require_memory(const std::filesystem::path& path, std::size_t blocks, std::size_t block_bytes) {
  if (memory_bound()) return;
  const double bytes = static_cast<double>(blocks) * static_cast<double>(block_bytes);
  const MemoryLimit limit = memory_limit();
  if (bytes > limit.bytes)
    fail(path, "its active voxels need " + bytes_text(bytes) + ", more than " + limit.cause + ", " +
                   bytes_text(limit.bytes) + "; resample it more coarsely, or give --memory");
}

}  // namespace tensorray
