// The entry of libFuzzer, for the target TENSORRAY_FUZZ_TARGET. The preset `fuzz` builds one program for each target:
//   build/fuzz/bin/fuzz_ply NEW_CORPUS tests/fuzz/corpus/ply

#include <algorithm>
#include <cstdint>
#include <string>

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using tensorray::test::FuzzTarget, tensorray::test::fuzz_targets;
  static const FuzzTarget target = *std::find_if(fuzz_targets().begin(), fuzz_targets().end(), [](const FuzzTarget& t) {
    return std::string(t.name) == TENSORRAY_FUZZ_TARGET;
  });
  target.read(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
