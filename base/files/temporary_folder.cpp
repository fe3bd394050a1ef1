#include "base/files/temporary_folder.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace tensorray {
namespace {

/// Greater than the descriptors of a child's standard streams and of the shared file.
constexpr int min_descriptor = 10;

[[noreturn]] void fail_to_make(const char* what, int reason) {
  throw std::runtime_error(std::string("no temporary ") + what + " can be made in " + temporary_files().string() +
                           ": " + std::generic_category().message(reason) + "; name another folder in TMPDIR");
}

constexpr std::chrono::milliseconds pause(30);

using NotedInode = std::pair<unsigned long long, unsigned long long>;

NotedInode inode_of(const Descriptor& file) {
  struct stat status {};
  return fstat(file.get(), &status) == 0 ? NotedInode(status.st_dev, status.st_ino) : NotedInode();
}

/// Whether a note that is open is that of the path: another process may have removed it meanwhile.
bool is_at(const Descriptor& note, const std::filesystem::path& path) {
  struct stat named {};
  return stat(path.c_str(), &named) == 0 && inode_of(note) == NotedInode(named.st_dev, named.st_ino);
}

/// Opens the note and locks it. @return not open if it cannot be had.
Descriptor locked_note(const std::filesystem::path& path, const std::function<void()>& waiting) {
  for (;;) {
    Descriptor note = open_file(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK, 0600);
    struct stat status {};
    if (!note.is_open() || fstat(note.get(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_uid != geteuid())
      return {};
    while (flock(note.get(), LOCK_EX | LOCK_NB) != 0) {
      if (errno != EWOULDBLOCK && errno != EINTR) return {};
      waiting();
      std::this_thread::sleep_for(pause);
    }
    if (is_at(note, path)) return note;
  }
}

/// Unlocks explicitly: a child process may have the descriptor, too.
void unlock(const Descriptor& note) { flock(note.get(), LOCK_UN); }

/// The file that a note names by a process, its descriptor, and what tells whether that is still the file.
Descriptor open_noted(const Descriptor& note) {
  std::array<char, 128> text{};
  if (pread(note.get(), text.data(), text.size() - 1, 0) <= 0) return {};
  std::istringstream words(text.data());
  std::string process, descriptor;
  NotedInode inode;
  if (!(words >> process >> descriptor >> inode.first >> inode.second)) return {};
  Descriptor file = open_file("/proc/" + process + "/fd/" + descriptor, O_RDONLY | O_NONBLOCK);
  return file.is_open() && inode_of(file) == inode ? std::move(file) : Descriptor();
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

SharedFile::SharedFile(const std::string& key, const std::function<void()>& waiting)
    : path_(temporary_files() / ("tensorray-" + std::to_string(geteuid()) + "-" + key)),
      note_(locked_note(path_, waiting)) {
  if (note_.is_open()) file_ = open_noted(note_);
  if (!file_.is_open()) return;
  unlock(note_);
  note_ = Descriptor();
}

SharedFile::~SharedFile() {
  if (!note_.is_open()) return;
  if (is_at(note_, path_)) unlink(path_.c_str());
  unlock(note_);
}

void SharedFile::offer(const Descriptor& file) {
  if (!note_.is_open()) return;
  file_ = duplicate(file);
  std::ostringstream text;
  const NotedInode inode = inode_of(file_);
  text << getpid() << ' ' << file_.get() << ' ' << inode.first << ' ' << inode.second << '\n';
  // With a note that could not be written whole, the others make their own files.
  if (ftruncate(note_.get(), 0) == 0) static_cast<void>(write_whole_at(note_.get(), text.str(), 0));
  unlock(note_);
}

}  // namespace tensorray
