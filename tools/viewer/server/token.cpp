#include "tools/viewer/server/token.h"

#include <cstdlib>
#include <fstream>
#include <random>

#include <fcntl.h>
#include <fmt/format.h>

#include "base/files/descriptor.h"

namespace tensorray {
namespace {

constexpr std::size_t digits = 32;

/// The folder that a variable of the environment names; empty if it names none. A relative path would be one of the
/// working folder's, and counts as none (XDG Base Directory Specification).
std::filesystem::path folder_of(const char* variable) {
  const char* const text = std::getenv(variable);
  const std::filesystem::path folder = text ? text : "";
  return folder.is_absolute() ? folder : std::filesystem::path();
}

/// Empty if there is no such folder.
std::filesystem::path state_folder() {
  if (const auto state = folder_of("XDG_STATE_HOME"); !state.empty()) return state / "tensorray";
  if (const auto home = folder_of("HOME"); !home.empty()) return home / ".local" / "state" / "tensorray";
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
  if (folder.empty()) return random_token();
  const std::filesystem::path file = folder / "view-token";
  std::string token;
  std::getline(std::ifstream(file) >> std::ws, token);
  if (is_token(token)) return token;
  token = random_token();
  std::error_code ignored;  // Without the file, the token is good for this run.
  std::filesystem::create_directories(folder, ignored);
  Descriptor written = open_file(file, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const bool is_kept = written.is_open() && write_whole(written.get(), token + "\n") && written.close();
  if (!is_kept) std::filesystem::remove(file, ignored);
  return token;
}

}  // namespace tensorray
