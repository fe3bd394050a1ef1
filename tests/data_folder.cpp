#include "tests/data_folder.h"

#include <cstdlib>

namespace tensorray::test {

std::filesystem::path source_folder() { return TENSORRAY_SOURCE_DIR; }

std::filesystem::path data_folder() {
  const char* const given = std::getenv("TENSORRAY_DATA");
  return given ? std::filesystem::path(given) : source_folder() / ".." / "shared" / "data";
}

}  // namespace tensorray::test
