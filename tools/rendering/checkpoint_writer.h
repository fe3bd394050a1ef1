#pragma once
/// @file tools/rendering/checkpoint_writer.h
/// Checkpoints of a render while it runs.

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "scenes/jobs/work_file.h"
#include "scenes/scene/render.h"
#include "scenes/scene/scene.h"

namespace tensorray {

struct KeepSettings {
  std::filesystem::path file;  ///< The checkpoint; empty: none is written.
  double interval = 60;        ///< Seconds between checkpoints; 0: only those that are asked for.
  double watch = 0;            ///< Seconds between pictures of what there is so far; 0: only those that are asked for.
  bool quiet = false;
  const std::atomic<bool>* cancelled =
      nullptr;  ///< When it becomes true, a checkpoint is written at once; may be null.
};

/// While it lives, a thread writes the work of a render to a checkpoint, and asks the work for pictures, after each
/// interval and when SIGUSR1 comes. Where a checkpoint cannot be written, it says so once; the render goes on, and the
/// last checkpoint stays.
class CheckpointWriter {
 public:
  /// All arguments must outlive it.
  CheckpointWriter(const Scene& scene, RenderJob& job, const KeepSettings& settings);
  ~CheckpointWriter();
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  /// Writes the checkpoint now. @return whether there is one of this work, new or old.
  bool write();

  /// Removes the checkpoint, and writes no other: the work is in other files.
  void remove();

  /// The work so far, as a file has it.
  WorkFile work_file();

 private:
  void run();
  void begin();
  WorkFile file_of_work();

  const Scene& scene_;
  RenderJob& job_;
  const KeepSettings& settings_;
  std::mutex writing_;  ///< Guards what follows.
  std::optional<Json> origin_;
  bool is_written_ = false, has_failed_ = false, is_over_ = false;

  std::mutex waiting_;
  std::condition_variable wake_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace tensorray
