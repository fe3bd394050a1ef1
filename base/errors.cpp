#include "base/errors.h"

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tensorray {

void require(bool condition, const char* message) {
  if (!condition) throw std::invalid_argument(message);
}

void require(bool condition, const std::string& message) { require(condition, message.c_str()); }

void fail(const std::filesystem::path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": " + what);
}

void require_no_device(const std::filesystem::path& path) {
  std::error_code none;
  if (std::filesystem::is_other(path, none)) fail(path, "is a pipe or a device, where a file is expected; remove it");
}

void require_readable(const std::filesystem::path& path) {
  const auto fail = [&path](const std::string& reason) {
    throw std::runtime_error("cannot read " + path.string() + ": " + reason);
  };
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) fail("no such file");
  if (status.type() == std::filesystem::file_type::directory) fail("it is a folder, not a file");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::generic_category().message(errno));
  if (file.peek() == std::ifstream::traits_type::eof()) fail("the file is empty");
}

}  // namespace tensorray
