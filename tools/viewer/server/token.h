#pragma once
/// @file tools/viewer/server/token.h
/// The secret in the address of a live view.

#include <string>

namespace tensorray {

/// 128 random bits, as hexadecimal digits.
std::string random_token();

/// The token of this user, which stays the same, so that pages find a server that was started again. It is kept in
/// $XDG_STATE_HOME/tensorray or ~/.local/state/tensorray, in a file that only the user may read. Where it cannot be
/// kept, it is a new one.
std::string token_of_user();

}  // namespace tensorray
