#pragma once
/// File descriptors of the system. Where this project needs one, and not a stream, it is a Descriptor.

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace tensorray {

/// Owns a file descriptor, and closes it at the end. -1: none.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;

  int get() const { return value_; }
  bool is_open() const { return value_ >= 0; }

  /// @return false if bytes that were written before cannot be stored; `errno` says why. Closed already: true.
  bool close();

 private:
  int value_ = -1;
};

/// Opens a file; programs that this one starts do not get it. @param flags  As for open(2); a new file has the mode
/// 0666 without the bits of the umask. @return a descriptor that is not open if it fails; `errno` says why.
Descriptor open_file(const std::filesystem::path& path, int flags, unsigned mode = 0666);

/// Another descriptor of the same open file. @return a descriptor that is not open if it fails; `errno` says why.
Descriptor duplicate(const Descriptor& file);

/// Writes all bytes, however many calls it takes. @return false if it fails; `errno` says why.
bool write_whole(int descriptor, std::string_view bytes);

/// The same at a position of a file, for several threads at once.
bool write_whole_at(int descriptor, std::string_view bytes, std::uint64_t at);

/// Reads `count` bytes at a position of a file. @return false if it fails, or the file does not have them.
bool read_whole_at(int descriptor, void* bytes, std::size_t count, std::uint64_t at);

}  // namespace tensorray
