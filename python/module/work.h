#pragma once
/// Long work for Python: without the GIL, with progress, and ended by Ctrl-C.

#include <functional>

#include <pybind11/pybind11.h>

#include "base/process/progress.h"

namespace tensorray {

/// Calls `work` on a thread of its own. Meanwhile this thread has released the GIL; twenty times a second it takes it
/// to call `report(phase, done, total)`, and to see whether a signal has come. An exception of `report` or of a signal
/// handler (KeyboardInterrupt) cancels the work, and is thrown when it has ended. What the work has said last is
/// reported when it has ended without an error, however short it was.
/// @param report   A function, or None. @param threads  Greatest number of threads that the work uses; 0: all.
/// @throw whatever `work` throws. It must not touch Python's objects.
void run(const pybind11::object& report, int threads, const std::function<void(const Progress&)>& work);

/// Cancels the work of all threads, and waits a few seconds for its end. `run` then throws SystemExit to all threads
/// but this one, also where it is called later. Python calls it at its exit: a thread (a daemon) that asks for the GIL
/// afterwards is ended by Python within C++, which ends the process.
void end_all_work();

}  // namespace tensorray
