#include "renderer/file_error.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tensorray {

std::string one_line(const std::string& text) {
  std::string line;
  std::size_t begin = 0;
  while ((begin = text.find_first_not_of(" \t\r\n", begin)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of("\r\n", begin), text.size());
    const std::size_t last = text.find_last_not_of(" \t", end - 1);
    if (!line.empty()) line += "; ";
    line += text.substr(begin, last + 1 - begin);
    begin = end;
  }
  return line;
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
