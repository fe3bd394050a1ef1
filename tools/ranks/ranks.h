#pragma once
/// The processes that `mpirun` started together, as Ranks.

#include <memory>

#include "base/process/progress.h"
#include "base/process/ranks.h"

namespace tensorray {

/// Where a rank ends before `finish`, whether by an error or a signal, mpirun ends all others, and names it.
class JoinedRanks : public Ranks {
 public:
  /// Waits until all ranks have called it. None can be used afterwards.
  virtual void finish() = 0;
};

/// Joins the other processes. @param progress  Ranks that are cancelled do not wait. Must outlive the result.
/// @return null if this process was started alone, or is the only one: MPI, which takes half a second to start, is not
/// loaded then.
/// @throw std::runtime_error with the fix if there are others, but the part of the program that uses MPI is not built.
std::unique_ptr<JoinedRanks> join_ranks(const Progress& progress);

}  // namespace tensorray
