#include "tools/rendering/checkpoint_writer.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "base/process/seconds.h"
#include "base/text/text.h"
#include "scenes/jobs/origin.h"
#include "tools/command_line/interrupts.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

constexpr double longest_tick = 0.2;  // Seconds after which a signal is noticed.

}  // namespace

CheckpointWriter::CheckpointWriter(const Scene& scene, RenderJob& job, const KeepSettings& settings)
    : scene_(scene), job_(job), settings_(settings), thread_([this] {
        try {
          run();
        } catch (...) {  // There was no memory even for a warning: the render goes on.
        }
      }) {}

CheckpointWriter::~CheckpointWriter() {
  {
    const std::lock_guard lock(waiting_);
    ends_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

WorkFile CheckpointWriter::work_file() {
  const std::lock_guard lock(writing_);
  return file_of_work();
}

WorkFile CheckpointWriter::file_of_work() {
  if (!origin_) origin_ = origin_of(scene_);
  const std::vector<WorkUnit> before = job_.before.units();
  return {*origin_, std::filesystem::absolute(scene_.description.path), job_.work.part(), job_.work.units(),
          before.empty() ? WorkUnit() : before.front()};
}

bool CheckpointWriter::write() {
  const std::lock_guard lock(writing_);
  if (settings_.file.empty() || is_over_) return false;
  try {
    const WorkFile file = file_of_work();
    if (!file.before.state &&
        std::none_of(file.units.begin(), file.units.end(), [](const WorkUnit& unit) { return unit.state; }))
      return false;
    write_work(settings_.file, file);
    is_written_ = true;
  } catch (const std::exception& error) {  // Whatever it is: the render goes on.
    if (!has_failed_) tell({fmt::format("warning: no checkpoint: {}", escaped(error.what()))}, false);
    has_failed_ = true;
  }
  std::error_code none;
  return is_written_ || std::filesystem::exists(settings_.file, none);
}

void CheckpointWriter::remove() {
  const std::lock_guard lock(writing_);
  is_over_ = true;  // The thread may be about to write.
  std::error_code error;
  if (!settings_.file.empty()) std::filesystem::remove(settings_.file, error);
}

/// Finds what the work belongs to while the files are those that were loaded.
void CheckpointWriter::begin() {
  const std::lock_guard lock(writing_);
  if (origin_ || settings_.file.empty() || (job_.work.units().empty() && job_.before.units().empty())) return;
  try {
    origin_ = origin_of(scene_);
  } catch (const std::exception&) {  // write() reports it.
  }
}

void CheckpointWriter::run() {
  const std::chrono::duration<double> tick(settings_.interval > 0 ? std::min(longest_tick, settings_.interval / 2)
                                                                  : longest_tick);
  Clock::time_point written = Clock::now(), shown = written;
  bool is_cancelled = false;
  std::unique_lock lock(waiting_);
  while (!wake_.wait_for(lock, tick, [this] { return ends_; })) {
    lock.unlock();
    begin();
    // Soon after SIGTERM, mpirun and queues kill a process, which may still be busy with units.
    if (settings_.cancelled && *settings_.cancelled && !std::exchange(is_cancelled, true)) write();
    const bool is_asked = take_picture_request();
    if (is_asked || (settings_.watch > 0 && seconds_since(shown) > settings_.watch)) {
      job_.work.picture_wanted = true;
      shown = Clock::now();
    }
    if (is_asked || (settings_.interval > 0 && seconds_since(written) > settings_.interval)) {
      write();
      written = Clock::now();
    }
    lock.lock();
  }
}

}  // namespace tensorray
