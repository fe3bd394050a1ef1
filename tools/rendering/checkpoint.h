#pragma once
/// Checkpoints of a render: written while it runs, and read by the one that continues it.

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "scenes/jobs/work_file.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"
#include "tools/rendering/render_scene.h"

namespace tensorray {

/// Where the run keeps its work; empty: nowhere. @throw SceneError if the run must continue, and there is no
/// checkpoint.
std::filesystem::path checkpoint_file(const SceneDescription& description, const RunKeeping& keeping);

/// What a run begins with.
struct EarlierResults {
  Results results;
  std::filesystem::path file;  ///< Where they are from; empty if there are none.
};

/// Gives a checkpoint that a run cannot use another name, and says it. @param why  With the file's name.
void set_aside(const std::filesystem::path& checkpoint, const std::string& why, bool quiet);

/// Those of the checkpoint, and light of the file that --light names, if the checkpoint has none. Says both, and if
/// that file has no light. A checkpoint of another render is set aside, unless the run must continue.
/// @throw SceneError if one of the two is of another render; as read_work.
EarlierResults read_earlier(const std::filesystem::path& checkpoint, const RenderRun& run, const Scene& scene);

/// While it lives, a thread writes the work of a render to a checkpoint, and asks the work for pictures, after each
/// interval and when SIGUSR1 comes. Where none can be written, it says so once, and the last stays.
class Checkpoint {
 public:
  /// @param file  Empty: none is written. The other arguments must outlive it.
  Checkpoint(const Scene& scene, Job& job, std::filesystem::path file, const RunKeeping& keeping,
             const Progress& progress);
  ~Checkpoint();
  Checkpoint(const Checkpoint&) = delete;
  Checkpoint& operator=(const Checkpoint&) = delete;

  /// Writes the checkpoint now. @return whether there is one of this work, new or old.
  bool write();

  /// Removes the checkpoint, and writes no other: the work is in other files.
  void remove();

  const std::filesystem::path& file() const { return file_; }  ///< Until `remove`.

  /// What the file of a shard has, when it is complete.
  WorkFile shard();

 private:
  void run();
  WorkFile work_file();

  const Scene& scene_;
  Job& job_;
  const RunKeeping& keeping_;
  const Progress& progress_;
  std::mutex writing_;  ///< Guards what follows.
  std::filesystem::path file_;
  std::optional<Json> origin_;
  bool is_written_ = false, has_failed_ = false;

  std::mutex waiting_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace tensorray
