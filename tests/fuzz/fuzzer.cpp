// The entries of libFuzzer, in the program `tensorray_fuzz` of the preset `asan-ubsan`. TENSORRAY_FUZZ_TARGET names a
// target of targets.cpp. tools/fuzz runs it.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/fuzz/targets.h"

namespace {

using tensorray::test::FuzzTarget, tensorray::test::fuzz_targets;

const FuzzTarget* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
  const char* const name = std::getenv("TENSORRAY_FUZZ_TARGET");
  const auto& targets = fuzz_targets();
  const auto found = std::find_if(targets.begin(), targets.end(),
                                  [&](const FuzzTarget& target) { return name && std::string(target.name) == name; });
  if (found == targets.end()) {
    std::fputs("TENSORRAY_FUZZ_TARGET must be one of:", stderr);
    for (const FuzzTarget& target : targets) std::fprintf(stderr, " %s", target.name);
    std::fputs("\n", stderr);
    std::exit(2);
  }
  chosen = &*found;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->read(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
