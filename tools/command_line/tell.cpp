#include "tools/command_line/tell.h"

#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

#include "base/files/descriptor.h"
#include "base/text/text.h"

namespace tensorray {

void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) >= 0) continue;
    // The system gives the least number that is free, which is this one, as those before it are open.
    static_cast<void>(open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
  }
}

void print_error(std::string_view text) noexcept { static_cast<void>(write_whole(STDERR_FILENO, text)); }

void tell(const std::vector<std::string>& lines, bool quiet) {
  if (quiet) return;
  for (const std::string& line : lines) print_error(line + "\n");
}

void tell_made(const std::string& line) {
  std::fflush(stdout);  // In the order of what was printed before.
  static_cast<void>(write_whole(STDOUT_FILENO, escaped(line) + "\n"));
}

}  // namespace tensorray
