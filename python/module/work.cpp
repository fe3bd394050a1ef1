#include "python/module/work.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include <tbb/task_arena.h>
#include <unistd.h>

#include "base/process/process_limits.h"

namespace tensorray {
namespace {

namespace py = pybind11;

constexpr std::chrono::milliseconds interval(50);

/// What the working thread and the waiting one share.
struct Call {
  Progress progress;
  std::mutex mutex;
  std::condition_variable ended;
  bool is_done = false;
  std::exception_ptr error;
  std::string phase;
  std::uint64_t done = 0, total = 0;
};

/// The calls that run, of all threads of this process.
struct Calls {
  std::mutex mutex;
  std::condition_variable ended;
  std::set<Call*> running;
  std::optional<std::thread::id> exiting;  ///< The thread that ends Python; it may still work, in other exit handlers.
  pid_t process = getpid();                // A process that was forked has the set, but not the threads.
};

Calls& calls() {
  static Calls* const all = new Calls;  // Never deleted: threads may outlive the library's other objects.
  return *all;
}

/// Whether Python ends, and this thread is another one than that which ends it.
bool is_exiting() {
  const std::lock_guard<std::mutex> lock(calls().mutex);
  return calls().exiting && *calls().exiting != std::this_thread::get_id();
}

/// Ends the thread without a word. Python prints other exceptions of threads, and kills them meanwhile: the stream then
/// stays locked, and Python, which flushes it at its end, aborts.
[[noreturn]] void leave_thread() {
  PyErr_SetNone(PyExc_SystemExit);
  throw py::error_already_set();
}

class Running {
 public:
  explicit Running(Call& call) : call_(call) {
    const std::lock_guard<std::mutex> lock(calls().mutex);
    calls().running.insert(&call);
  }
  ~Running() {
    const std::lock_guard<std::mutex> lock(calls().mutex);
    calls().running.erase(&call_);
    calls().ended.notify_all();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  Call& call_;
};

void do_work(Call& shared, const std::function<void(const Progress&)>& work, int threads) {
  std::exception_ptr error;
  try {
    tbb::task_arena arena(threads > 0 ? threads : static_cast<int>(usable_processors()));
    arena.execute([&] { work(shared.progress); });
  } catch (...) {
    error = std::current_exception();
  }
  const std::lock_guard<std::mutex> lock(shared.mutex);
  shared.error = error;
  shared.is_done = true;
  shared.ended.notify_one();
}

/// @throw py::error_already_set if a signal or `report` raised an exception; std::bad_alloc.
void look_up(Call& shared, const py::object& report) {
  std::unique_lock<std::mutex> lock(shared.mutex);
  const std::string phase = shared.phase;
  const std::uint64_t done = shared.done, total = shared.total;
  lock.unlock();
  if (is_exiting()) throw Cancelled();  // What `report` does could take for ever.
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (!report.is_none() && total > 0) report(phase, done, total);
}

}  // namespace

void run(const py::object& report, int threads, const std::function<void(const Progress&)>& work) {
  if (threads < 0 || threads > 4096) throw std::invalid_argument("threads: from 1 to 4096, or 0 for all");
  Call shared;
  const Running running(shared);  // Until this thread has the GIL again.
  if (is_exiting()) leave_thread();
  shared.progress.report = [&shared](const std::string& phase, std::uint64_t done, std::uint64_t total) {
    const std::lock_guard<std::mutex> lock(shared.mutex);
    shared.phase = phase;
    shared.done = done;
    shared.total = total;
  };
  std::exception_ptr interrupt;
  {
    const py::gil_scoped_release released;
    std::thread thread([&] { do_work(shared, work, threads); });
    std::unique_lock<std::mutex> lock(shared.mutex);
    while (!shared.ended.wait_for(lock, interval, [&] { return shared.is_done; })) {
      lock.unlock();
      try {
        if (!interrupt) look_up(shared, report);
      } catch (...) {
        interrupt = std::current_exception();
        shared.progress.cancelled = true;
      }
      lock.lock();
    }
    lock.unlock();
    thread.join();
  }
  if (is_exiting()) leave_thread();
  if (interrupt) std::rethrow_exception(interrupt);
  if (shared.error) std::rethrow_exception(shared.error);
  look_up(shared, report);  // Short work, too, is reported.
}

void end_all_work() {
  if (calls().process != getpid()) return;
  const py::gil_scoped_release released;
  std::unique_lock<std::mutex> lock(calls().mutex);
  calls().exiting = std::this_thread::get_id();
  for (Call* const call : calls().running) call->progress.cancelled = true;
  constexpr std::chrono::seconds patience(5);  // A function of the user that reports progress may never return.
  calls().ended.wait_for(lock, patience, [] { return calls().running.empty(); });
}

}  // namespace tensorray
