#pragma once
/// @file tools/ranks/ranks.h
/// The processes of one job that `mpirun` started together. Each has a number, its rank, from 0 on.
/// Rank 0 is a Leader, all others are Followers. `Ranks` is what both need of MPI; in tests, ranks are threads.

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tensorray {

struct RankBytes {
  int from = 0;  ///< The rank that sent them.
  std::string bytes;
};

/// This process among the others. One thread at a time may use it. Messages from one rank to another keep their order.
/// Where a rank ends before `finish`, whether by an error or a signal, mpirun ends all others, and names it.
class Ranks {
 public:
  virtual ~Ranks() = default;

  virtual int rank() const = 0;
  virtual int count() const = 0;

  /// Waits until the other rank receives. It does not keep the processor busy.
  virtual void send(int to, const std::string& bytes) = 0;

  /// A message that has come, if there is one. Does not wait.
  virtual std::optional<RankBytes> receive() = 0;

  /// Waits until all ranks have called it. None can be used afterwards.
  virtual void finish() = 0;
};

/// The ranks to which a rank passes on what comes from rank 0 to all: a binomial tree, so that no rank sends it more
/// than log2(count) times. The first has the most ranks behind it.
std::vector<int> next_ranks(int rank, int count);

/// Joins the other processes. @return null if this process was started alone, or is the only one: MPI, which takes half
/// a second to start, is not loaded then.
/// @throw std::runtime_error with the fix if there are others, but the part of the program that uses MPI is not built.
std::unique_ptr<Ranks> join_ranks();

}  // namespace tensorray
