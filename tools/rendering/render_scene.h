#pragma once
/// @file tools/rendering/render_scene.h
/// Renders a scene file and writes its outputs.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/process/progress.h"
#include "base/process/work.h"
#include "scenes/jobs/work_file.h"
#include "scenes/pipeline/read_scene.h"

namespace tensorray {

class Follower;
class Leader;

/// How a run keeps its work.
struct RunKeeping {
  bool is_on = true;                 ///< Whether there are checkpoints.
  double interval = 60;              ///< Seconds between checkpoints; 0: only where the run is interrupted.
  bool resume = false;               ///< Continue from the checkpoint, if there is one.
  bool watch = false;                ///< Keep the pictures up to date while they are rendered.
  std::optional<WorkPart> shard;     ///< Do only this part of the work,
  std::filesystem::path shard_file;  ///< and write it to this file, and no picture.
  std::filesystem::path light;       ///< A shard or checkpoint that has what is made before the tiles; empty: none.
};

struct RenderRun {
  RunKeeping keeping;
  Leader* leader = nullptr;          ///< Other processes that render, too; null: there are none.
  std::size_t memory = 0;            ///< What may be resident, in bytes; 0: without a bound.
  unsigned threads = 0;              ///< Number of threads; 0: all.
  bool skip_existing = false;        ///< Leave out frames of which all files exist, but no checkpoint.
  bool keep_going = false;           ///< Of a sequence: a frame that fails does not end it.
  bool quiet = false;                ///< Print only errors.
  std::filesystem::path statistics;  ///< JSON file for the statistics; empty: none.
  std::filesystem::path scene_copy;  ///< File for the scene with its changes; empty: none.
};

/// Reads the scene file (or the field's; see read_scene), loads the scene, renders it and writes its outputs. Prints a
/// progress bar and notes.
/// The work is kept in a checkpoint beside the first output, PICTURE.checkpoint, while the render runs, and where it is
/// interrupted, with the picture so far.
/// @throw SceneError, std::invalid_argument, std::runtime_error, Cancelled; Interrupted.
void render_scene(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                  Progress& progress);

/// Renders frames of a scene (see set_frame), one after the other. The scale and the direction `auto` are those of the
/// first frame. A field that does not change is loaded once. Where there are other ranks, and the method's work is not
/// divided, each takes the next frame.
/// @return the frames that failed, where the run keeps going; they were named on standard error.
/// @throw as render_scene; SceneError if the names of files do not count frames, so that one would replace another.
std::vector<int> render_frames(const std::filesystem::path& scene_file, SceneChanges changes,
                               const std::vector<int>& frames, const RenderRun& run, Progress& progress);

/// Renders what rank 0 asks for, which calls render_scene or render_frames with the same arguments, until it has no
/// more: units of its scenes, or frames. @return frames that failed here, where the run keeps going.
/// @throw as render_scene.
std::vector<int> follow(const std::filesystem::path& scene_file, const SceneChanges& changes, const RenderRun& run,
                        Follower& follower, Progress& progress);

/// Makes the pictures of a scene of work that is done. The work must be all of it, and that of the scene.
/// @throw as render_scene.
void write_merged(const SceneDescription& description, const WorkFile& work, const RenderRun& run, Progress& progress);

}  // namespace tensorray
