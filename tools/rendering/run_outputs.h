#pragma once
/// @file tools/rendering/run_outputs.h
/// The files that a run writes.

#include <filesystem>
#include <string>
#include <vector>

#include "base/files/output_file.h"
#include "scenes/description/description.h"
#include "scenes/outputs/write_outputs.h"
#include "tools/rendering/render_scene.h"

namespace tensorray {

/// Keys among the outputs, because all files are committed together.
inline const std::string statistics_key = "--stats", scene_key = "--save-scene", shard_key = "--shard";

/// All files that the run will write. @throw SceneError; std::runtime_error naming one that cannot be written.
OutputFiles open_files(const SceneDescription& description, const RenderRun& run);

/// The run with the frame's number in the names of its files.
RenderRun at_frame(RenderRun run, int frame);

/// The files of the result.
std::vector<std::filesystem::path> written_by(const SceneDescription& description, const RenderRun& run);

/// The same, and that of the statistics.
std::vector<std::filesystem::path> files_of(const SceneDescription& description, const RenderRun& run);

/// Where a run keeps its work; empty: nowhere.
std::filesystem::path checkpoint_of(const SceneDescription& description, const RunKeeping& keeping);

}  // namespace tensorray
