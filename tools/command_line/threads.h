#pragma once
/// The threads of a command.

#include <tbb/global_control.h>

namespace tensorray {

/// While it lives, work is done by this many threads.
class Threads {
 public:
  /// @param asked  0: all processors that this process may use (usable_processors).
  /// @throw std::runtime_error with the fix if the system does not start so many.
  explicit Threads(unsigned asked = 0);

 private:
  tbb::global_control limit_;
};

/// The threads that work is divided among: those of Threads, but no more than processors.
unsigned running_threads();

}  // namespace tensorray
