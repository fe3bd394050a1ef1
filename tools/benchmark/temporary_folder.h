#pragma once
/// @file tools/benchmark/temporary_folder.h
/// A folder for temporary files.

#include <filesystem>
#include <string>

#include <unistd.h>

namespace tensorray::benchmark {

/// A folder of this process. The destructor removes it with all its files.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(std::filesystem::temp_directory_path() / ("tensorray_bench_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // An error here must not discard the measurements.
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace tensorray::benchmark
