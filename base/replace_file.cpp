#include "base/replace_file.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include "base/errors.h"

namespace tensorray {
namespace {

class SafeFile {
 public:
  SafeFile(const std::filesystem::path& path, int flags) : value_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~SafeFile() { close(); }
  SafeFile(const SafeFile&) = delete;
  SafeFile& operator=(const SafeFile&) = delete;

  bool is_open() const { return value_ >= 0; }
  bool flush() const { return ::fsync(value_) == 0; }
  bool close() { return value_ < 0 || ::close(std::exchange(value_, -1)) == 0; }

  bool write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(value_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }

 private:
  int value_;
};

bool write_pieces(SafeFile& file, const std::vector<std::string_view>& pieces) {
  if (!file.is_open()) return false;
  for (const std::string_view piece : pieces)
    if (!file.write(piece)) return false;
  return file.flush() && file.close();
}

}  // namespace

void replace_file(const std::filesystem::path& file, const std::vector<std::string_view>& pieces) {
  const std::filesystem::path temporary = file.string() + ".new";
  SafeFile written(temporary, O_WRONLY | O_CREAT | O_TRUNC);
  if (!write_pieces(written, pieces) || ::rename(temporary.c_str(), file.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    fail(file, fmt::format("cannot be written: {}", std::strerror(error)));
  }
  const SafeFile folder(file.has_parent_path() ? file.parent_path() : ".", O_RDONLY | O_DIRECTORY);
  if (folder.is_open()) folder.flush();  // Some file systems cannot do this; the name is then safe a little later.
}

}  // namespace tensorray
