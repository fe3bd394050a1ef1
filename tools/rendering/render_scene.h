#pragma once
/// Renders a scene file and writes its outputs. Its drivers: frames.cpp renders sequences, checkpoint.h keeps the
/// work and continues it, rank_scene.h gives the scene to other ranks.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/files/output_file.h"
#include "base/process/job.h"
#include "base/process/progress.h"
#include "integrators/methods/read_scene.h"
#include "scenes/description/description.h"
#include "scenes/jobs/work_file.h"
#include "scenes/outputs/write_outputs.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// How a run keeps its work.
struct RunKeeping {
  bool is_on = true;                 ///< Whether there are checkpoints.
  double interval = 60;              ///< Seconds between checkpoints; 0: only where the run is interrupted.
  bool resume = false;               ///< It is an error if there is no checkpoint, or one of another render.
  bool watch = false;                ///< Keep the pictures up to date while they are rendered.
  std::optional<WorkPart> shard;     ///< Do only this part of the work,
  std::filesystem::path shard_file;  ///< and write it to this file, and no picture.
  std::filesystem::path light;       ///< A shard or checkpoint that has what is made before the tiles; empty: none.
};

struct RenderRun {
  RunKeeping keeping;
  Ranks* ranks = nullptr;            ///< Processes that render together with this one, the root; null: alone.
  std::size_t memory = 0;            ///< What the making of a field works with, bytes; 0: no field in files.
  unsigned threads = 0;              ///< Number of threads; 0: all.
  bool skip_existing = false;        ///< Leave out frames of which all files exist, but no checkpoint.
  bool keep_going = false;           ///< Of a sequence: a frame that fails does not end it.
  bool quiet = false;                ///< Print only errors.
  std::vector<NamedFile> inputs;     ///< Files that are read beside those of the scene, and must not be replaced.
  std::filesystem::path statistics;  ///< JSON file for the statistics; empty: none.
  std::filesystem::path scene_copy;  ///< File for the scene with its changes; empty: none.
};

/// Reads the scene file (or the field's; see read_scene), loads the scene, renders it and writes its outputs. Prints a
/// progress bar and notes. Of ranks, only the root reads the file, prints and writes.
/// The work is kept in a checkpoint beside the first output, PICTURE.checkpoint, while the render runs, and where it is
/// interrupted, with the picture so far.
/// @return changes that fix what was chosen: the direction of the light, and the strength (LoadedMethod::strength).
/// @throw SceneError, std::invalid_argument, std::runtime_error, Cancelled; Interrupted.
std::vector<std::string> render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes,
                                      const RenderRun& run, Progress& progress);

/// Renders frames of a scene (see set_frame), one after the other; of ranks, each renders every so many. The scale and
/// the direction `auto` are those of the first frame. A field that does not change is loaded once.
/// @return the frames that failed, where the run keeps going, at the root; they were named on standard error.
/// @throw as render_scene; SceneError if the names of files do not count frames, so that one would replace another.
std::vector<int> render_frames(const std::filesystem::path& scene_file, SceneChanges changes, std::vector<int> frames,
                               const RenderRun& run, Progress& progress);

/// Makes the pictures of a scene of shards, whose results must be all there are, and those of the scene.
/// @throw as render_scene.
void merge_shards(const SceneDescription& description, WorkFile shards, const RenderRun& run, Progress& progress);

/// The same from a description on. @param loaded  The scene of an earlier frame: what has not changed is not loaded
/// again. @return the scene.
Scene render_to_files(const SceneDescription& description, const RenderRun& run, std::optional<Scene> loaded,
                      Progress& progress);

/// Pages of a field that is larger than the memory are on the disk of the result.
void bound_memory_of(const RenderRun& run, const SceneDescription& description);

// The files that a run writes.

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
