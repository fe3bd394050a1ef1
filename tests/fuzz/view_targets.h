#pragma once
/// What the live view is sent, as functions of any bytes: see targets.h.

#include <string>

namespace tensorray::test {

/// A client's bytes, over a connection of its own; PORT stands for the server's port, and "secret" is the token.
/// @return whether they are answered with 200 or 101.
bool read_http(const std::string& bytes);

/// A message of a page. Waits until the page's next message is answered.
/// @return whether no error is answered before.
bool read_page_message(const std::string& bytes);

}  // namespace tensorray::test
