#include "tools/rendering/checkpoint.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <new>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/process/seconds.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "tools/command_line/run_and_report.h"
#include "tools/command_line/tell.h"

namespace tensorray {
namespace {

constexpr double longest_tick = 0.2, watch_interval = 5;  // Seconds: a signal is noticed; pictures of --watch.

/// @throw SceneError unless the file is of this scene.
WorkFile read_work_of(const std::filesystem::path& file, const Scene& scene, const std::string& fix) {
  WorkFile work = read_work(file);
  if (const std::string other = difference(work.origin, origin_of(scene, work.is_complete)); !other.empty())
    throw SceneError(printable(fmt::format("{}: is of another render: {}{}", file.string(), other, fix)));
  return work;
}

bool is_there(const std::filesystem::path& file) {
  std::error_code none;
  return !file.empty() && std::filesystem::exists(file, none);
}

bool is_light(const std::pair<const std::string, Result>& result) {
  return result.first.compare(0, light_name.size(), light_name) == 0;
}

bool has_light(const Results& results) { return std::any_of(results.begin(), results.end(), is_light); }

Results read_checkpoint(const std::filesystem::path& file, const RenderRun& run, const Scene& scene) {
  WorkFile work = read_work_of(file, scene, run.keeping.resume ? "; undo the change, or leave --resume out" : "");
  const WorkPart part = run.keeping.shard.value_or(WorkPart{});
  if (work.part.index != part.index || work.part.count != part.count)
    throw SceneError(printable(fmt::format("{}: is part {} of {} of the render; give its --shard", file.string(),
                                           work.part.index + 1, work.part.count)));
  return std::move(work.results);
}

}  // namespace

std::filesystem::path checkpoint_file(const SceneDescription& description, const RunKeeping& keeping) {
  std::filesystem::path file = checkpoint_of(description, keeping);
  if (keeping.resume && !is_there(file))
    throw SceneError(printable(fmt::format("--resume: there is no checkpoint {}; leave --resume out", file.string())));
  return file;
}

void set_aside(const std::filesystem::path& checkpoint, const std::string& why, bool quiet) {
  std::filesystem::path name = checkpoint;
  for (int i = 1; is_there(name); ++i) name = with_suffix(checkpoint, fmt::format(".{}", i));
  std::filesystem::rename(checkpoint, name);
  tell({fmt::format("note: {}; it is kept as {}", escaped(why), name.string())}, quiet);
}

EarlierResults read_earlier(const std::filesystem::path& checkpoint, const RenderRun& run, const Scene& scene) {
  EarlierResults earlier;
  try {
    if (is_there(checkpoint)) earlier.results = read_checkpoint(checkpoint, run, scene);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    if (run.keeping.resume) throw;
    set_aside(checkpoint, error.what(), run.quiet);
  }
  if (!earlier.results.empty()) {
    earlier.file = checkpoint;
    tell({"continues from " + checkpoint.string()}, run.quiet);
  }
  const std::filesystem::path& light = run.keeping.light;
  if (light.empty() || has_light(earlier.results)) return earlier;
  const WorkFile other = read_work_of(light, scene, "; undo the change, or leave --light out");
  if (!has_light(other.results))
    tell({fmt::format("note: {} has no light, because it was made quickly, or because another shard is the first one; "
                      "it is made again",
                      light.string())},
         run.quiet);
  for (const auto& result : other.results)
    if (is_light(result)) earlier.results.insert(result);
  if (earlier.file.empty()) earlier.file = light;
  return earlier;
}

Checkpoint::Checkpoint(const Scene& scene, Job& job, std::filesystem::path file, const RunKeeping& keeping,
                       const Progress& progress)
    : scene_(scene), job_(job), keeping_(keeping), progress_(progress), file_(std::move(file)), thread_([this] {
        try {
          run();
        } catch (...) {  // There was no memory even for a warning: the render goes on.
        }
      }) {}

Checkpoint::~Checkpoint() {
  {
    const std::lock_guard lock(waiting_);
    ends_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

WorkFile Checkpoint::work_file() {
  if (!origin_) origin_ = origin_of(scene_, false);
  return {*origin_, std::filesystem::absolute(scene_.description.path), job_.part(), false, job_.results()};
}

WorkFile Checkpoint::shard() {
  const std::lock_guard lock(writing_);
  WorkFile file = work_file();
  file.is_complete = true;
  const Json hashed = origin_of(scene_);  // Shards are put together on other machines, too.
  if (difference(file.origin, hashed).empty()) file.origin = hashed;
  if (job_.part().index == 0) return file;
  for (auto result = file.results.begin();
       result != file.results.end();)  // All shards have it: the first one keeps it.
    result = is_light(*result) ? file.results.erase(result) : std::next(result);
  return file;
}

bool Checkpoint::write() {
  const std::lock_guard lock(writing_);
  if (file_.empty()) return false;
  try {
    const WorkFile work = work_file();
    if (work.results.empty()) return false;
    write_work(file_, work);
    is_written_ = true;
  } catch (const std::exception& error) {  // Whatever it is: the render goes on.
    if (!has_failed_) tell({fmt::format("warning: no checkpoint: {}", escaped(error.what()))}, false);
    has_failed_ = true;
  }
  return is_written_ || is_there(file_);
}

void Checkpoint::remove() {
  const std::lock_guard lock(writing_);
  std::error_code error;
  if (!file_.empty()) std::filesystem::remove(file_, error);
  file_.clear();  // The thread may be about to write.
}

void Checkpoint::run() {
  try {  // While the files are those that were loaded.
    const std::lock_guard lock(writing_);
    if (!file_.empty() && !origin_) origin_ = origin_of(scene_, false);
  } catch (const std::exception&) {  // write() reports it.
  }
  const double interval = keeping_.interval;
  const std::chrono::duration<double> tick(interval > 0 ? std::min(longest_tick, interval / 2) : longest_tick);
  Clock::time_point written = Clock::now(), shown = written;
  bool is_cancelled = false;
  std::unique_lock lock(waiting_);
  while (!wake_.wait_for(lock, tick, [this] { return ends_; })) {
    lock.unlock();
    // Soon after SIGTERM, mpirun and queues kill a process, which may still be busy with units.
    if (progress_.cancelled && !std::exchange(is_cancelled, true)) write();
    const bool is_asked = take_picture_request();
    if (is_asked || (keeping_.watch && seconds_since(shown) > watch_interval)) {
      job_.picture_wanted = true;
      shown = Clock::now();
    }
    if (is_asked || (interval > 0 && seconds_since(written) > interval)) {
      write();
      written = Clock::now();
    }
    lock.lock();
  }
}

}  // namespace tensorray
