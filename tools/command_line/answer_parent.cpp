#include "tools/command_line/answer_parent.h"

#include <csignal>
#include <exception>
#include <new>
#include <string>

#include "base/process/child_program.h"
#include "base/process/process_limits.h"
#include "tools/command_line/tell.h"

namespace tensorray {

int answer_parent(const std::function<void()>& work) {
  end_with_parent();
  limit_memory();
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    work();
    return 0;
  } catch (const std::bad_alloc&) {
    print_error("it does not fit in memory\n");
  } catch (const std::exception& error) {
    print_error(std::string(error.what()) + "\n");
  }
  return 1;
}

}  // namespace tensorray
