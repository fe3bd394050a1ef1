#pragma once
/// @file tools/ranks/rank_message.h
/// What rank 0, which leads a job, and the others say to each other. Rank 0 only answers.

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace tensorray {

enum class RankWord : std::uint32_t {
  job,     ///< To 0: I have nothing to do. The answer: what to do, as text.
  unit,    ///< A unit of the job, with its state. To 0: this far I have done it. From 0: do it.
  more,    ///< To 0: I need units, `number` for all threads. The answer ends their list; an empty list: there are none.
  finish,  ///< From 0: there are no more jobs.
};

struct RankMessage {
  RankWord word = RankWord::job;
  std::uint32_t job = 0;
  std::uint64_t number = 0;
  std::uint64_t is_done = 0;  ///< Of a unit.
  std::string bytes;
};

/// Numbers have the byte order of the machine: all machines of a job must have the same.
inline std::string bytes_of(const RankMessage& message) {
  const std::uint64_t head[] = {static_cast<std::uint64_t>(message.word) << 32 | message.job, message.number,
                                message.is_done};
  std::string bytes(sizeof head, 0);
  std::memcpy(bytes.data(), head, sizeof head);
  return bytes += message.bytes;
}

inline RankMessage rank_message(const std::string& bytes) {
  std::uint64_t head[3];
  if (bytes.size() < sizeof head) throw std::runtime_error("mpirun: a message between ranks is damaged");
  std::memcpy(head, bytes.data(), sizeof head);
  return {static_cast<RankWord>(head[0] >> 32), static_cast<std::uint32_t>(head[0]), head[1], head[2],
          bytes.substr(sizeof head)};
}

}  // namespace tensorray
