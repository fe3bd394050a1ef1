/// Ranks by MPI: the only code that uses it. It is a library of its own (ranks.cpp loads it).

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <mpi.h>

#include "tools/ranks/ranks.h"

namespace tensorray {
namespace {

constexpr std::size_t piece_size = std::size_t{1} << 30;  // Values that MPI, which counts by int, moves at once.
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

  std::vector<std::string> all_gather(const std::string& mine) override {
    std::vector<std::string> all = room_for(wait_for_all(mine.size()));
    all[rank()] = mine;
    for (int root = 0; root < count_; ++root) {
      std::string& bytes = all[static_cast<std::size_t>(root)];
      broadcast_from(root, bytes.data(), bytes.size());
    }
    return all;
  }

  std::vector<std::string> gather(const std::string& mine) override {
    const std::vector<std::uint64_t> sizes = wait_for_all(mine.size());
    if (rank_ > 0) {
      in_pieces(mine.data(), mine.size(),
                [](const char* piece, int count) { MPI_Send(piece, count, MPI_BYTE, 0, 0, MPI_COMM_WORLD); });
      return {};
    }
    std::vector<std::string> all = room_for(sizes);
    all[0] = mine;
    for (int from = 1; from < count_; ++from) {
      std::string& bytes = all[static_cast<std::size_t>(from)];
      in_pieces(bytes.data(), bytes.size(), [&](char* piece, int count) {
        MPI_Recv(piece, count, MPI_BYTE, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      });
    }
    return all;
  }

  void broadcast(void* bytes, std::size_t size) override {
    wait_for_all(size);
    broadcast_from(0, static_cast<char*>(bytes), size);
  }

  void sum(std::vector<std::uint64_t>& numbers) override {
    wait_for_all(numbers.size());
    in_pieces(numbers.data(), numbers.size(), [](std::uint64_t* piece, int count) {
      MPI_Allreduce(MPI_IN_PLACE, piece, count, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    });
  }

  void finish() override { MPI_Finalize(); }

 private:
  /// Calls `use(piece, count)` for one piece after the other.
  template <class Value, class Use>
  static void in_pieces(Value* values, std::size_t count, const Use& use) {
    for (; count > 0; values += std::min(count, piece_size), count -= std::min(count, piece_size))
      use(values, static_cast<int>(std::min(count, piece_size)));
  }

  static void broadcast_from(int root, char* bytes, std::size_t size) {
    in_pieces(bytes, size, [&](char* piece, int count) { MPI_Bcast(piece, count, MPI_BYTE, root, MPI_COMM_WORLD); });
  }

  static std::vector<std::string> room_for(const std::vector<std::uint64_t>& sizes) {
    std::vector<std::string> all;
    for (const std::uint64_t size : sizes) all.emplace_back(size, 0);
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
