#include "base/files/distinct_files.h"

#include <map>
#include <stdexcept>
#include <system_error>
#include <tuple>

#include <sys/stat.h>

#include "base/files/output_file.h"

namespace tensorray {
namespace {

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
