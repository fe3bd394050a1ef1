#include "base/files/temporary_folder.h"

#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace tensorray {
namespace {

/// Greater than the descriptors of a child's standard streams and of the shared file.
constexpr int min_descriptor = 10;

[[noreturn]] void fail_to_make(const char* what, int reason) {
  throw std::runtime_error(std::string("no temporary ") + what + " can be made in " + temporary_files().string() +
                           ": " + std::generic_category().message(reason) + "; name another folder in TMPDIR");
}

}  // namespace

std::filesystem::path temporary_files() {
  std::error_code none;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(none);
  return none ? "/tmp" : folder;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (temporary_files() / "tensorray_XXXXXX").string();
  if (!mkdtemp(name.data())) fail_to_make("folder", errno);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;  // A destructor must not throw.
  std::filesystem::remove_all(path_, ignored);
}

Descriptor open_unnamed(const std::filesystem::path& folder) {
  std::string name = (folder / ".tensorray-XXXXXX").string();
  Descriptor file(mkostemp(name.data(), O_CLOEXEC));
  if (file.is_open()) unlink(name.c_str());
  return file;
}

UnnamedFile::UnnamedFile() {
  const Descriptor made = open_unnamed(temporary_files());
  if (!made.is_open()) fail_to_make("file", errno);
  file_ = Descriptor(fcntl(made.get(), F_DUPFD_CLOEXEC, min_descriptor));
  if (!file_.is_open()) fail_to_make("file", errno);
}

std::filesystem::path UnnamedFile::path() const { return "/proc/self/fd/" + std::to_string(descriptor()); }

}  // namespace tensorray
