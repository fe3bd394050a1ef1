#pragma once
/// @file base/text/parse_number.h
/// Numbers as data files write them.

#include <optional>
#include <string_view>

namespace tensorray {

/// The number that all of `text` is, in every locale: "1", "+2.5e-3", "nan". Numbers that double precision does not
/// hold become 0 or infinite.
std::optional<double> parse_number(std::string_view text);

}  // namespace tensorray
