#pragma once
/// @file base/temporary_folder.h
/// A folder for temporary files.

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace tensorray {

/// A new folder in the temporary folder. The destructor removes it with all its files.
class TemporaryFolder {
 public:
  /// @throw std::runtime_error naming the temporary folder.
  TemporaryFolder() {
    std::error_code none;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(none);
    std::string name = ((none ? "/tmp" : parent) / "tensorray_XXXXXX").string();
    if (!mkdtemp(name.data()))
      throw std::runtime_error("no temporary folder can be made as " + name + ": " +
                               std::generic_category().message(errno) + "; name another folder in TMPDIR");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // A destructor must not throw.
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace tensorray
