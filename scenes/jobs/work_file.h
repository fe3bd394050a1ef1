#pragma once
/// @file scenes/jobs/work_file.h
/// Files that hold results of a render: checkpoints and shards.

#include <filesystem>
#include <string>
#include <vector>

#include "base/process/job.h"
#include "scenes/keys/json_reader.h"

namespace tensorray {

struct WorkFile {
  Json origin;                       ///< What the results belong to; see origin.h.
  std::filesystem::path scene_file;  ///< Absolute. Paths in the scene are relative to its folder.
  WorkPart part;
  bool is_complete = false;  ///< Whether it has all results of its part.
  Results results;
};

/// Replaces `path` so that it is complete at any moment (output_file.h). @throw std::runtime_error naming the file.
void write_work(const std::filesystem::path& path, const WorkFile& work);

/// @throw std::runtime_error naming the file if it is missing, no such file, cut off or damaged.
WorkFile read_work(const std::filesystem::path& path);

/// The shards of a render, put together: their part has the number of shards.
/// @param files  In any order.
/// @throw std::invalid_argument naming shards that are missing, repeated, incomplete or of another render; as
/// read_work.
WorkFile read_shards(const std::vector<std::string>& files);

}  // namespace tensorray
