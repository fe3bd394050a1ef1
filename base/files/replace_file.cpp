#include "base/files/replace_file.h"

#include <cerrno>
#include <cstdint>
#include <cstring>

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include "base/errors.h"
#include "base/files/descriptor.h"
#include "base/text/content_hash.h"

namespace tensorray {
namespace {

bool write_pieces(Descriptor& file, const std::vector<std::string_view>& pieces) {
  if (!file.is_open()) return false;
  for (const std::string_view piece : pieces)
    if (!write_whole(file.get(), piece)) return false;
  return ::fsync(file.get()) == 0 && file.close();
}

}  // namespace

void replace_file(const std::filesystem::path& file, const std::vector<std::string_view>& pieces) {
  const std::uint64_t name = content_hash(file.filename().string());
  const std::filesystem::path temporary = file.parent_path() / fmt::format(".tensorray-{:016x}.new", name);
  Descriptor written = open_file(temporary, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW);
  if (!write_pieces(written, pieces) || ::rename(temporary.c_str(), file.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    fail(file, fmt::format("cannot be written: {}", std::strerror(error)));
  }
  const Descriptor folder = open_file(file.has_parent_path() ? file.parent_path() : ".", O_RDONLY | O_DIRECTORY);
  // Some file systems cannot do this; the name is then safe a little later.
  if (folder.is_open()) static_cast<void>(::fsync(folder.get()));
}

}  // namespace tensorray
