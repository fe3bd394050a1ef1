#include <algorithm>
#include <exception>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "scenes/jobs/work_file.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"
#include "tools/command_line/threads.h"
#include "tools/rendering/render_scene.h"

namespace tensorray {
namespace {

/// A sequence reads its scene for each frame. @throw SceneError if it comes through a pipe.
void require_file(const std::filesystem::path& scene_file) {
  std::error_code none;
  if (std::filesystem::is_other(scene_file, none))
    throw SceneError(printable(scene_file.string()) +
                     ": a sequence reads its scene for each frame, and a pipe is read once; save the scene to a file");
}

/// Whether the files of a frame are there, and complete. A name that cannot be looked at does not exist; opening the
/// file says why.
bool is_rendered(const SceneDescription& description, const RenderRun& run) {
  const auto is_there = [](const std::filesystem::path& file) {
    std::error_code none;
    return std::filesystem::exists(file, none);
  };
  const std::vector<std::filesystem::path> files = files_of(description, run);
  const std::filesystem::path checkpoint = checkpoint_of(description, run.keeping);
  return std::all_of(files.begin(), files.end(), is_there) && (checkpoint.empty() || !is_there(checkpoint));
}

class Sequence {
 public:
  Sequence(std::filesystem::path scene_file, SceneChanges changes, const RenderRun& run, Progress& progress)
      : scene_file_(std::move(scene_file)), changes_(std::move(changes)), run_(run), progress_(progress) {
    run_.ranks = nullptr;  // Each frame is that of one rank.
  }

  /// @throw SceneError if two frames have a file in common.
  void check_names(const std::vector<int>& frames) {
    std::vector<std::vector<std::filesystem::path>> names;
    for (std::size_t i = 0; i < frames.size() && names.size() < 2; ++i) {
      try {
        names.push_back(files_of(description_at(frames[i]), at_frame(run_, frames[i])));
      } catch (const std::invalid_argument&) {
        if (!run_.keep_going) throw;  // Else it is reported when its turn comes.
      }
    }
    if (names.size() < 2) return;
    for (const std::filesystem::path& name : names[0])
      if (std::find(names[1].begin(), names[1].end(), name) != names[1].end())
        throw SceneError(printable(fmt::format(
            "{}: each frame would replace it; count frames by # in its name, as in picture.####.png", name.string())));
  }

  /// What the frames have in common: the scale and the direction, where scenes leave them open. They are those of the
  /// first frame; where the run keeps going, of the first one that can be loaded, if any.
  Json common_values(const std::vector<int>& frames) {
    for (const int frame : frames) {
      try {
        const SceneDescription first = description_at(frame);
        bound_memory_of(run_, first);
        if (!first.field.scale || !first.light.direction) loaded_ = load_scene(first, progress_);
        const Eigen::Vector3d direction = loaded_ ? *loaded_->description.light.direction : *first.light.direction;
        return {{"scale", loaded_ ? loaded_->scale.scale : *first.field.scale},
                {"direction", {direction.x(), direction.y(), direction.z()}}};
      } catch (const Cancelled&) {
        throw;
      } catch (const std::invalid_argument&) {
        if (!run_.keep_going || frame == frames.back()) throw;
      } catch (const std::exception&) {
        if (!run_.keep_going) throw;
      }
    }
    return Json::object();
  }

  /// Those that are left.
  std::vector<int> left(std::vector<int> frames) {
    if (!run_.skip_existing) return frames;
    const auto is_done = [&](int frame) {
      try {
        return is_rendered(description_at(frame), at_frame(run_, frame));
      } catch (const std::exception&) {
        return false;  // It is reported when its turn comes.
      }
    };
    frames.erase(std::remove_if(frames.begin(), frames.end(), is_done), frames.end());
    return frames;
  }

  /// With --keep-going, a frame that fails is noted, and others follow.
  void render(int frame, const Json& common) {
    try {
      SceneDescription description = description_at(frame);
      if (common.contains("scale")) set_chosen(common, description);
      bound_memory_of(run_, description);
      tell({fmt::format("frame {}", frame)}, run_.quiet);
      RenderRun run = at_frame(run_, frame);
      // Frames that were not begun have no checkpoint.
      run.keeping.resume &= std::filesystem::exists(checkpoint_of(description, run.keeping));
      Scene rendered = render_to_files(description, run, std::exchange(loaded_, {}), progress_);
      loaded_.emplace(std::move(rendered));
    } catch (const Cancelled&) {
      throw;
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& error) {
      if (!run_.keep_going) throw;
      tell({fmt::format("tensorray: frame {}: {}", frame, reason_of(error))}, false);
      failed.push_back(frame);
      loaded_.reset();
    }
  }

  std::vector<int> failed;

 private:
  SceneDescription description_at(int frame) {
    changes_.frame = frame;
    return read_scene(scene_file_, changes_);
  }

  const std::filesystem::path scene_file_;
  SceneChanges changes_;
  RenderRun run_;
  Progress& progress_;
  std::optional<Scene> loaded_;  // Of the last frame.
};

}  // namespace

std::vector<int> render_frames(const std::filesystem::path& scene_file, SceneChanges changes, std::vector<int> frames,
                               const RenderRun& run, Progress& progress) {
  const Threads threads(run.threads);
  set_image_threads(static_cast<int>(running_threads()));
  Sequence sequence(scene_file, changes, run, progress);
  std::string common;
  if (is_root(run.ranks)) {  // What is wrong with the scene is said once.
    require_file(scene_file);
    sequence.check_names(frames);
    common = sequence.common_values(frames).dump();
    frames = sequence.left(std::move(frames));
  }
  broadcast_list(run.ranks, frames);
  broadcast_list(run.ranks, common);
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (is_mine(run.ranks, i)) sequence.render(frames[i], parse_value(common));
  std::vector<int> failed = sequence.failed;
  gather_in_turn(run.ranks, [&](Archive& archive) {
    std::vector<int> more = sequence.failed;
    archive.copy_list(more);
    if (archive.reads()) failed.insert(failed.end(), more.begin(), more.end());
  });
  std::vector<int> in_order;
  std::copy_if(frames.begin(), frames.end(), std::back_inserter(in_order),
               [&](int frame) { return std::find(failed.begin(), failed.end(), frame) != failed.end(); });
  return in_order;
}

}  // namespace tensorray
