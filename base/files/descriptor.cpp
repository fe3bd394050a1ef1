#include "base/files/descriptor.h"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace tensorray {

Descriptor::~Descriptor() { close(); }

Descriptor::Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this == &other) return *this;
  close();
  value_ = std::exchange(other.value_, -1);
  return *this;
}

bool Descriptor::close() { return value_ < 0 || ::close(std::exchange(value_, -1)) == 0; }

Descriptor open_file(const std::filesystem::path& path, int flags, unsigned mode) {
  return Descriptor(::open(path.c_str(), flags | O_CLOEXEC, mode));
}

Descriptor duplicate(const Descriptor& file) { return Descriptor(fcntl(file.get(), F_DUPFD_CLOEXEC, 0)); }

namespace {

/// Calls `move(done)`, which moves some of `count` bytes from number `done` on and returns how many, until all are.
template <class Move>
bool move_whole(std::size_t count, const Move& move) {
  for (std::size_t done = 0; done < count;) {
    const ssize_t moved = move(done);
    if (moved < 0 && errno == EINTR) continue;
    if (moved <= 0) return false;
    done += static_cast<std::size_t>(moved);
  }
  return true;
}

}  // namespace

bool write_whole(int descriptor, std::string_view bytes) {
  return move_whole(bytes.size(),
                    [&](std::size_t done) { return ::write(descriptor, bytes.data() + done, bytes.size() - done); });
}

bool write_whole_at(int descriptor, std::string_view bytes, std::uint64_t at) {
  return move_whole(bytes.size(), [&](std::size_t done) {
    return ::pwrite(descriptor, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
  });
}

bool read_whole_at(int descriptor, void* bytes, std::size_t count, std::uint64_t at) {
  return move_whole(count, [&](std::size_t done) {
    return ::pread(descriptor, static_cast<char*>(bytes) + done, count - done, static_cast<off_t>(at + done));
  });
}

}  // namespace tensorray
