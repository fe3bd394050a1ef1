#include "base/files/shared_file.h"

#include <cerrno>
#include <chrono>
#include <sstream>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files/temporary_folder.h"

namespace tensorray {
namespace {

constexpr std::chrono::milliseconds pause(30);
constexpr int most_tries = 30;  ///< Of a process that ends.

/// A line of the list: a process, and its descriptor of the file. Inodes tell whether it is still that file.
struct Holder {
  long process = 0;
  int descriptor = -1;
  unsigned long long device = 0, inode = 0;
};

Holder holder_of(const Descriptor& file) {
  struct stat status {};
  fstat(file.get(), &status);
  return {getpid(), file.get(), status.st_dev, status.st_ino};
}

/// The file of a holder, if it still has it.
Descriptor open_of(const Holder& holder) {
  const std::string path = "/proc/" + std::to_string(holder.process) + "/fd/" + std::to_string(holder.descriptor);
  Descriptor file = open_file(path, O_RDONLY | O_NONBLOCK);
  const Holder found = file.is_open() ? holder_of(file) : Holder();
  return found.device == holder.device && found.inode == holder.inode ? std::move(file) : Descriptor();
}

std::vector<Holder> read_list(const Descriptor& list) {
  struct stat status {};
  std::string text;
  if (fstat(list.get(), &status) == 0 && status.st_size < 1 << 20)
    text.resize(static_cast<std::size_t>(status.st_size));
  if (!read_whole_at(list.get(), text.data(), text.size(), 0)) return {};
  std::istringstream lines(text);
  std::vector<Holder> holders;
  for (Holder each; lines >> each.process >> each.descriptor >> each.device >> each.inode;) holders.push_back(each);
  return holders;
}

/// Whether a list that is open is that of the path: another process may have removed it meanwhile.
bool is_at(const Descriptor& list, const std::filesystem::path& path) {
  struct stat open {
  }, named{};
  return fstat(list.get(), &open) == 0 && stat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

bool is_ours(const Descriptor& list) {
  struct stat status {};
  return fstat(list.get(), &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid();
}

/// Opens the list and locks it. @param waits  Whether to wait on, while another process has it locked.
/// @return not open if it cannot be had.
Descriptor locked_list(const std::filesystem::path& path, const std::function<bool()>& waits) {
  for (;;) {
    Descriptor list = open_file(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK, 0600);
    if (!list.is_open() || !is_ours(list)) return {};
    while (flock(list.get(), LOCK_EX | LOCK_NB) != 0) {
      if ((errno != EWOULDBLOCK && errno != EINTR) || !waits()) return {};
      std::this_thread::sleep_for(pause);
    }
    if (is_at(list, path)) return list;
  }
}

}  // namespace

SharedFile::SharedFile(const std::string& key, const std::function<void()>& waiting)
    : path_(temporary_files() / ("tensorray-" + std::to_string(geteuid()) + "-" + key)), list_(locked_list(path_, [&] {
        waiting();
        return true;
      })) {
  if (!list_.is_open()) return;
  for (const Holder& holder : read_list(list_))
    if (!file_.is_open()) file_ = open_of(holder);
  if (file_.is_open()) write_list();
}

SharedFile::~SharedFile() {
  // Where another process begins to make a file, that one cleans up.
  if (!list_.is_open()) list_ = locked_list(path_, [tries = 0]() mutable { return ++tries < most_tries; });
  file_ = Descriptor();
  if (list_.is_open()) write_list();
}

void SharedFile::offer(const Descriptor& file) {
  if (!list_.is_open()) return;
  file_ = duplicate(file);
  write_list();
}

/// Writes the processes that have a file, and unlocks the list; removes it if there are none.
void SharedFile::write_list() {
  std::vector<Holder> holders;
  for (const Holder& each : read_list(list_))
    if (open_of(each).is_open()) holders.push_back(each);
  if (file_.is_open()) holders.insert(holders.begin(), holder_of(file_));
  std::ostringstream text;
  for (const Holder& each : holders)
    text << each.process << ' ' << each.descriptor << ' ' << each.device << ' ' << each.inode << '\n';
  // A list that could not be written whole has fewer processes; they then do not share.
  if (holders.empty())
    unlink(path_.c_str());
  else if (ftruncate(list_.get(), 0) == 0)
    static_cast<void>(write_whole_at(list_.get(), text.str(), 0));
  flock(list_.get(), LOCK_UN);  // A child process may have it, too.
  list_ = Descriptor();
}

}  // namespace tensorray
