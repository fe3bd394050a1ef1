#pragma once
/// @file tests/fuzz/view_targets.h
/// What the live view is sent, as functions of any bytes: see targets.h.

#include <string>

namespace tensorray::test {

/// A client's bytes, over a connection of its own; PORT stands for the server's port, and "secret" is the token.
void read_http(const std::string& bytes);

/// A message of a page. Waits until the page's next message is answered.
void read_page_message(const std::string& bytes);

}  // namespace tensorray::test
