#include "tools/viewer/token.h"

#include <cstdlib>
#include <fstream>
#include <random>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

namespace tensorray {
namespace {

constexpr std::size_t digits = 32;

/// Empty if there is no such folder.
std::filesystem::path state_folder() {
  if (const char* state = std::getenv("XDG_STATE_HOME")) return std::filesystem::path(state) / "tensorray";
  if (const char* home = std::getenv("HOME")) return std::filesystem::path(home) / ".local" / "state" / "tensorray";
  return {};
}

bool is_token(const std::string& text) {
  return text.size() == digits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

std::string random_token() {
  std::random_device device;  // Of the system; see random(7).
  std::string token;
  for (std::size_t i = 0; i < digits / 8; ++i) token += fmt::format("{:08x}", device());
  return token;
}

std::string token_of_user() {
  const std::filesystem::path folder = state_folder();
  std::string token;
  if (!folder.empty()) std::getline(std::ifstream(folder / "view-token") >> std::ws, token);
  if (is_token(token)) return token;
  token = random_token();
  std::error_code ignored;  // Without the file, the token is good for this run.
  std::filesystem::create_directories(folder, ignored);
  const int file = open((folder / "view-token").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0) return token;
  const std::string line = token + "\n";
  if (write(file, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    std::filesystem::remove(folder / "view-token", ignored);
  close(file);
  return token;
}

}  // namespace tensorray
