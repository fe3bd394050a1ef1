/// Ranks by MPI: the only code that uses it. It is a library of its own (ranks.cpp loads it).

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <mpi.h>

#include "tools/ranks/ranks.h"

namespace tensorray {
namespace {

constexpr std::uint64_t piece_bytes = std::uint64_t{1} << 30;  // Of all ranks: MPI counts them by int.
constexpr std::chrono::microseconds first_wait(10), longest_wait(1000);

class MpiRanks : public JoinedRanks {
 public:
  explicit MpiRanks(const Progress& progress) : progress_(progress) {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &count_);
    if (level < MPI_THREAD_FUNNELED) throw std::runtime_error("mpirun: this MPI does not support threads");
  }

  std::size_t rank() const override { return static_cast<std::size_t>(rank_); }
  std::size_t count() const override { return static_cast<std::size_t>(count_); }

  std::vector<std::string> all_gather(const std::string& mine) override { return exchange(mine, true); }
  std::vector<std::string> gather(const std::string& mine) override { return exchange(mine, false); }
  void finish() override { MPI_Finalize(); }

 private:
  std::vector<std::string> exchange(const std::string& mine, bool to_all) {
    const std::vector<std::uint64_t> sizes = wait_for_all(mine.size());
    const bool receives = to_all || rank_ == 0;
    std::vector<std::string> all(receives ? count() : 0);
    const std::uint64_t piece = piece_bytes / count(), largest = *std::max_element(sizes.begin(), sizes.end());
    for (std::uint64_t begin = 0; begin < largest; begin += piece) {
      std::vector<int> counts, places;
      int sum = 0;
      for (const std::uint64_t size : sizes) {
        counts.push_back(static_cast<int>(std::min(piece, size - std::min(begin, size))));
        places.push_back(sum);
        sum += counts.back();
      }
      std::string received(receives ? static_cast<std::size_t>(sum) : 0, 0);
      const char* const from = mine.data() + std::min<std::uint64_t>(begin, mine.size());
      const int count = counts[rank()];
      if (to_all)
        MPI_Allgatherv(from, count, MPI_BYTE, received.data(), counts.data(), places.data(), MPI_BYTE, MPI_COMM_WORLD);
      else
        MPI_Gatherv(from, count, MPI_BYTE, received.data(), counts.data(), places.data(), MPI_BYTE, 0, MPI_COMM_WORLD);
      for (std::size_t each = 0; each < all.size(); ++each)
        all[each].append(received, static_cast<std::size_t>(places[each]), static_cast<std::size_t>(counts[each]));
    }
    return all;
  }

  /// Waits until all ranks are here, without keeping a processor busy. @return the sizes that they name.
  std::vector<std::uint64_t> wait_for_all(std::uint64_t size) const {
    std::vector<std::uint64_t> sizes(count());
    MPI_Request request;
    MPI_Iallgather(&size, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD, &request);
    int is_done = 0;
    for (auto wait = first_wait;; wait = std::min(2 * wait, longest_wait)) {
      MPI_Test(&request, &is_done, MPI_STATUS_IGNORE);
      if (is_done != 0) return sizes;
      if (progress_.cancelled) throw Cancelled();
      std::this_thread::sleep_for(wait);
    }
  }

  const Progress& progress_;
  int rank_ = 0, count_ = 1;
};

}  // namespace
}  // namespace tensorray

extern "C" tensorray::JoinedRanks* tensorray_join_ranks(const tensorray::Progress* progress) {
  return new tensorray::MpiRanks(*progress);
}
