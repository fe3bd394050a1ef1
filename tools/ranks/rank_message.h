#pragma once
/// @file tools/ranks/rank_message.h
/// What rank 0, which leads a job, and the others say to each other. Rank 0 only answers.

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace tensorray {

enum class RankWord : std::uint32_t {
  job,     ///< To 0: I have nothing to do. The answer: what to do, as text.
  unit,    ///< A unit of the job, with its state. To 0: this far I have done it. From 0: do it.
  more,    ///< To 0: I need units, `number` for all threads. The answer ends their list; an empty list: there are none.
  part,    ///< Of a step that all ranks do together. To 0: mine. From 0: those of all ranks, if they are given back;
           ///< they are passed on (next_ranks).
  finish,  ///< From 0: there are no more jobs.
};

struct RankMessage {
  RankWord word = RankWord::job;
  std::uint32_t job = 0;
  std::uint64_t number = 0;
  std::uint64_t is_done = 0;  ///< Of a unit.
  std::string bytes;
};

/// The number of bytes that it has on its way.
inline std::size_t size_of(const RankMessage& message) { return 3 * sizeof(std::uint64_t) + message.bytes.size(); }

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

/// Texts as one.
inline std::string packed(const std::vector<std::string>& texts) {
  std::string bytes;
  for (const std::string& text : texts) {
    const std::uint64_t size = text.size();
    bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
    bytes += text;
  }
  return bytes;
}

/// Such texts again. @throw std::runtime_error if the bytes are not those of `count` texts.
inline std::vector<std::string> unpacked(const std::string& bytes, std::size_t count) {
  std::vector<std::string> texts;
  std::size_t at = 0;
  const auto require_rest = [&](std::uint64_t size) {
    if (size > bytes.size() - at) throw std::runtime_error("mpirun: a message between ranks is damaged");
  };
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t size = 0;
    require_rest(sizeof size);
    std::memcpy(&size, bytes.data() + at, sizeof size);
    at += sizeof size;
    require_rest(size);
    texts.push_back(bytes.substr(at, size));
    at += size;
  }
  return texts;
}

}  // namespace tensorray
