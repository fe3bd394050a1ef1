#pragma once
/// @file scenes/jobs/work_file.h
/// Files that hold units of a render's work: checkpoints and shards.

#include <filesystem>
#include <string>
#include <vector>

#include "base/process/work.h"
#include "scenes/keys/json_reader.h"

namespace tensorray {

struct WorkFile {
  Json origin;                       ///< What the units belong to; see origin.h.
  std::filesystem::path scene_file;  ///< Absolute. Paths in the scene are relative to its folder.
  WorkPart part;
  std::vector<WorkUnit> units;  ///< All units of the work, whether begun or not.
  WorkUnit before = {};         ///< What is made before them (RenderJob).
};

/// Replaces `path` so that it is complete at any moment (replace_file.h). Numbers have the byte order of the machine:
/// all machines of a job must have the same. @throw std::runtime_error naming the file.
void write_work(const std::filesystem::path& path, const WorkFile& work);

/// @throw std::runtime_error naming the file if it is missing, no such file, cut off or damaged.
WorkFile read_work(const std::filesystem::path& path);

}  // namespace tensorray
