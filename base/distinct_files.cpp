#include "base/distinct_files.h"

#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <sys/stat.h>

#include "base/output_file.h"

namespace tensorray {
namespace {

namespace fs = std::filesystem;

/// Device, inode and name: of a file that is there, no name; of one that is not, those of its folder and its name. A
/// folder that is not there either has a name alone.
using Identity = std::tuple<dev_t, ino_t, std::string>;

Identity identity_of(const fs::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) return {status.st_dev, status.st_ino, ""};
  const fs::path target = fs::absolute(behind_links(path));
  for (const fs::path& each : {target, target.lexically_normal()})  // "none/../file" needs no folder "none".
    if (stat(each.parent_path().c_str(), &status) == 0) return {status.st_dev, status.st_ino, each.filename().string()};
  return {0, 0, target.lexically_normal().string()};
}

/// Whether it is neither a regular file nor absent.
bool is_device(const fs::path& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
}

}  // namespace

void require_distinct_files(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs) {
  std::map<Identity, std::string> taken;
  for (const NamedFile& input : inputs)
    if (!input.path.empty()) taken.emplace(identity_of(input.path), input.name);
  for (const NamedFile& output : outputs) {
    if (output.path.empty() || is_device(output.path)) continue;
    const auto [other, is_new] = taken.emplace(identity_of(output.path), output.name);
    if (!is_new)
      throw std::invalid_argument(output.name + " (" + output.path.string() + ") is the same file as " + other->second +
                                  "; choose another");
  }
}

}  // namespace tensorray
