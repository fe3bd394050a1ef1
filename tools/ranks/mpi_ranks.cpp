/// @file tools/ranks/mpi_ranks.cpp
/// Ranks by MPI: the only code that uses it. It is a library of its own (ranks.cpp loads it).

#include <algorithm>
#include <chrono>
#include <limits>
#include <stdexcept>
#include <thread>

#include <mpi.h>

#include "tools/ranks/ranks.h"

namespace tensorray {
namespace {

constexpr int tag = 0;
constexpr std::chrono::microseconds first_wait(10), longest_wait(1000);

class MpiRanks : public Ranks {
 public:
  MpiRanks() {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    if (level < MPI_THREAD_SERIALIZED) throw std::runtime_error("mpirun: this MPI does not support threads");
  }

  int rank() const override { return rank_; }
  int count() const override { return count_; }

  void send(int to, const std::string& bytes) override {
    if (bytes.size() > std::numeric_limits<int>::max())
      throw std::runtime_error("mpirun: a message has more than 2 GB; lower the number of bands");
    MPI_Request request;
    MPI_Isend(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, to, tag, MPI_COMM_WORLD, &request);
    int is_sent = 0;
    for (auto wait = first_wait;; wait = std::min(2 * wait, longest_wait)) {  // MPI_Wait would keep a processor busy.
      MPI_Test(&request, &is_sent, MPI_STATUS_IGNORE);
      if (is_sent != 0) return;
      std::this_thread::sleep_for(wait);
    }
  }

  std::optional<RankBytes> receive() override {
    int is_here = 0, size = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, tag, MPI_COMM_WORLD, &is_here, &status);
    if (is_here == 0) return std::nullopt;
    MPI_Get_count(&status, MPI_BYTE, &size);
    RankBytes message{status.MPI_SOURCE, std::string(static_cast<std::size_t>(size), 0)};
    MPI_Recv(message.bytes.data(), size, MPI_BYTE, message.from, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return message;
  }

  void finish() override { MPI_Finalize(); }

 private:
  int rank_ = 0, count_ = 1;
};

}  // namespace
}  // namespace tensorray

extern "C" tensorray::Ranks* tensorray_join_ranks() { return new tensorray::MpiRanks; }
