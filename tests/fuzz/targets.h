#pragma once
/// The parsers that are ours, each as a function of any bytes. A fuzzer looks for bytes that break them (fuzzer.cpp);
/// the bytes that broke them once, and some that are right, are in `corpus/NAME/`, and are a test (replay_test.cpp).

#include <string>
#include <vector>

namespace tensorray::test {

struct FuzzTarget {
  const char* name;
  /// Reads the bytes. An error that the reader reports is fine. @return whether there is none. @throw std::logic_error
  /// if it is not one line, or is no kind of error that run_and_report puts into words; whatever else the reader
  /// throws.
  bool (*read)(const std::string& bytes);
};

const std::vector<FuzzTarget>& fuzz_targets();

// What the live view is sent (view_targets.cpp).

/// A client's bytes, over a connection of its own; PORT stands for the server's port, and "secret" is the token.
/// @return whether they are answered with 200 or 101.
bool read_http(const std::string& bytes);

/// A message of a page. Waits until the page's next message is answered.
/// @return whether no error is answered before.
bool read_page_message(const std::string& bytes);

}  // namespace tensorray::test
