#include "base/files/output_file.h"

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <system_error>
#include <tuple>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files/descriptor.h"
#include "base/files/temporary_folder.h"
#include "base/text/content_hash.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

constexpr int longest_chain = 40;  // Of links: the limit of Linux.

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }

/// Makes an empty file with a new name in `folder`.
fs::path make_temporary(const fs::path& folder, const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  // Longer endings name no format, and a name has a greatest length.
  constexpr std::size_t longest_ending = 32;
  const std::string name = target.filename().string();  // `.png` has an ending, too.
  const std::size_t dot = name.rfind('.');
  const std::string ending = dot != name.npos && name.size() - dot <= longest_ending ? name.substr(dot) : "";
  while (true) {
    const fs::path path = folder / fmt::format(".tensorray-{}-{}{}", getpid(), counter++, ending);
    const Descriptor file = open_file(path, O_WRONLY | O_CREAT | O_EXCL);
    if (file.is_open()) return path;
    if (errno == EEXIST) continue;  // A killed process with the same process number left this file.
    fail(target, fmt::format("cannot write to the folder {}: {}", folder.string(), std::strerror(errno)));
  }
}

/// The number of an open descriptor of this process that a path names, as /dev/stdout and /dev/fd/3 do; −1: none.
int own_descriptor(fs::path path) {
  const std::string own = fmt::format("/proc/{}/fd", getpid());
  for (int i = 0; i < longest_chain; ++i) {
    std::error_code error;
    const std::string name = path.filename().string();
    const bool is_number = !name.empty() && name.size() < 10 && name.find_first_not_of("0123456789") == name.npos;
    if (is_number && fs::canonical(folder_of(path), error) == own) return std::stoi(name);
    const fs::path next = fs::read_symlink(path, error);
    if (error) return -1;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return -1;
}

/// Opens a device. What this process has open gets bytes where the last ones ended: a shell may have begun it.
Descriptor open_device(const fs::path& device) {
  const int own = own_descriptor(device);
  return own < 0 ? open_file(device, O_WRONLY) : Descriptor(fcntl(own, F_DUPFD_CLOEXEC, 0));
}

void copy_into(const fs::path& source, const fs::path& device) {
  const Descriptor from = open_file(source, O_RDONLY);
  if (!from.is_open()) fail(device, fmt::format("cannot read {}: {}", source.string(), std::strerror(errno)));
  Descriptor to = open_device(device);
  if (!to.is_open()) fail(device, fmt::format("cannot be opened: {}", std::strerror(errno)));
  std::vector<char> buffer(1 << 20);
  while (true) {
    const ssize_t size = ::read(from.get(), buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) fail(device, fmt::format("cannot read {}: {}", source.string(), std::strerror(errno)));
    if (size == 0) break;
    if (!write_whole(to.get(), {buffer.data(), static_cast<std::size_t>(size)}))
      fail(device, fmt::format("cannot be written: {}", std::strerror(errno)));
  }
  if (!to.close()) fail(device, fmt::format("cannot be written: {}", std::strerror(errno)));
}

bool write_pieces(Descriptor& file, const std::vector<std::string_view>& pieces) {
  if (!file.is_open()) return false;
  for (const std::string_view piece : pieces)
    if (!write_whole(file.get(), piece)) return false;
  return ::fsync(file.get()) == 0 && file.close();
}

namespace fs = std::filesystem;

/// Device, inode and name. A file that exists has an empty name. A file that does not exist has the device and inode of
/// its folder, and its own name. If its folder does not exist either, device and inode are 0, and the name is the path.
using Identity = std::tuple<dev_t, ino_t, std::string>;

Identity identity_of(const fs::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) return {status.st_dev, status.st_ino, ""};
  const fs::path target = fs::absolute(behind_links(path));
  // The second form is for "none/../file": the folder "none" need not exist.
  for (const fs::path& each : {target, target.lexically_normal()})
    if (stat(each.parent_path().c_str(), &status) == 0) return {status.st_dev, status.st_ino, each.filename().string()};
  return {0, 0, target.lexically_normal().string()};
}

}  // namespace

OutputFile::OutputFile(fs::path target) : target_(std::move(target)) {
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  const bool is_loop = error == std::errc::too_many_symbolic_link_levels;  // behind_links reports it.
  if (status.type() == fs::file_type::none && !is_loop)
    fail(target_, fmt::format("cannot be written: {}", error.message()));
  if (fs::is_directory(status) || !target_.has_filename()) fail(target_, "is a folder; give the name of a file");
  if (fs::exists(status) && ::access(target_.c_str(), W_OK) != 0)
    fail(target_, fmt::format("cannot be written: {}", std::strerror(errno)));
  const int own = fs::exists(status) ? own_descriptor(target_) : -1;
  if (own >= 0 && (fcntl(own, F_GETFL) & O_ACCMODE) == O_RDONLY) fail(target_, "is not open for writing");
  is_device_ = own >= 0 || (fs::exists(status) && !fs::is_regular_file(status));
  if (is_device_) {
    resolved_ = target_;
    temporary_ = make_temporary(temporary_files(), target_);
    return;
  }
  resolved_ = fs::exists(status) ? fs::canonical(target_) : behind_links(target_);
  const fs::path folder = folder_of(resolved_);
  if (!fs::is_directory(folder, error)) fail(target_, fmt::format("there is no folder {}; make it", folder.string()));
  temporary_ = make_temporary(folder, target_);
}

OutputFile::~OutputFile() { discard(); }

OutputFile::OutputFile(OutputFile&& other) noexcept
    : target_(std::move(other.target_)),
      resolved_(std::move(other.resolved_)),
      temporary_(std::exchange(other.temporary_, {})),
      backup_(std::exchange(other.backup_, {})),
      is_device_(other.is_device_) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  target_ = std::move(other.target_);
  resolved_ = std::move(other.resolved_);
  temporary_ = std::exchange(other.temporary_, {});
  backup_ = std::exchange(other.backup_, {});
  is_device_ = other.is_device_;
  return *this;
}

void OutputFile::rethrow_for_target(std::string message) const {
  const std::string name = temporary_.string();
  for (std::size_t at = message.find(name); at != std::string::npos; at = message.find(name, at + 1))
    message.replace(at, name.size(), target_.string());
  throw std::runtime_error(message);
}

void OutputFile::write_text(const std::string& text) {
  Descriptor file = open_file(temporary_, O_WRONLY | O_TRUNC);
  if (!file.is_open() || !write_whole(file.get(), text) || !file.close())
    fail(target_, fmt::format("cannot be written: {}", std::strerror(errno)));
}

void OutputFile::copy_into_device() {
  if (is_device_) copy_into(temporary_, resolved_);
}

/// Gives the old file at the target a second name, so that it can be restored.
void OutputFile::keep_old() {
  if (is_device_) return;
  std::error_code error;
  const fs::file_status old = fs::status(resolved_, error);
  if (!fs::exists(old)) return;
  if (!fs::is_regular_file(old))
    fail(target_, "has become a folder or a device while it was written; choose another name");
  fs::permissions(temporary_, old.permissions(), error);
  backup_ = make_temporary(folder_of(resolved_), target_);
  fs::remove(backup_, error);
  fs::create_hard_link(resolved_, backup_, error);
  if (!error) return;
  fs::rename(resolved_, backup_, error);  // The file system has no hard links.
  if (error) {
    backup_.clear();
    fail(target_, fmt::format("cannot be replaced: {}", error.message()));
  }
}

void OutputFile::replace_old() {
  if (is_device_) return;
  std::error_code error;
  fs::rename(temporary_, resolved_, error);
  if (error) fail(target_, fmt::format("cannot be replaced: {}", error.message()));
  temporary_.clear();
}

/// Restores the old file at the target.
void OutputFile::undo() noexcept {
  if (is_device_) return;
  std::error_code error;
  const bool replaced = temporary_.empty();
  if (!backup_.empty()) {
    fs::rename(backup_, resolved_, error);
    // If both names belong to one file, rename does nothing, and the backup is left.
    fs::remove(backup_, error);
  } else if (replaced) {
    fs::remove(resolved_, error);
  }
  backup_.clear();
}

void OutputFile::discard() noexcept {
  std::error_code error;
  for (fs::path* path : {&temporary_, &backup_}) {
    if (!path->empty()) fs::remove(*path, error);
    path->clear();
  }
}

fs::path behind_links(const fs::path& target) {
  fs::path path = target;
  for (int i = 0; i < longest_chain; ++i) {
    std::error_code error;
    if (!fs::is_symlink(fs::symlink_status(path, error))) return path;
    const fs::path next = fs::read_symlink(path, error);
    if (error) fail(target, fmt::format("cannot follow the link {}: {}", path.string(), error.message()));
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  fail(target, "is a loop of symbolic links; remove it or choose another name");
}

void OutputFile::commit() {
  std::vector<OutputFile> files;
  files.push_back(std::move(*this));
  commit_all(files);
}

void commit_all(std::vector<OutputFile>& files) {
  for (const OutputFile& file : files)
    if (file.temporary_.empty()) throw std::logic_error(file.target_.string() + ": was committed before");
  for (OutputFile& file : files) file.copy_into_device();
  try {
    for (OutputFile& file : files) file.keep_old();
    for (OutputFile& file : files) file.replace_old();
  } catch (...) {
    for (OutputFile& file : files) file.undo();
    throw;
  }
  for (OutputFile& file : files) file.discard();
}

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

bool is_device(const fs::path& path) {
  std::error_code none;
  return fs::is_other(path, none);
}

void require_distinct_files(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs) {
  std::map<Identity, std::string> taken;
  for (const NamedFile& input : inputs) {
    if (input.path.empty()) continue;
    if (is_device(input.path))
      throw std::invalid_argument(input.name + " (" + input.path.string() +
                                  ") is a pipe or a device; write what it gives to a file");
    taken.emplace(identity_of(input.path), input.name);
  }
  for (const NamedFile& output : outputs) {
    if (output.path.empty() || is_device(output.path)) continue;
    const auto [other, is_new] = taken.emplace(identity_of(output.path), output.name);
    if (!is_new)
      throw std::invalid_argument(output.name + " (" + output.path.string() + ") is the same file as " + other->second +
                                  "; choose another");
  }
}

}  // namespace tensorray
