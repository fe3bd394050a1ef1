#pragma once
/// @file base/text/numbered_name.h
/// Names of files of a sequence, in which a sign stands for the number of a frame or of a step of time: ####, or as
/// other programs write it, %04d or $F4. All three are at least four digits; #, %d and $F are at least one.

#include <string>

namespace tensorray {

/// Whether a name has a number.
bool has_number_sign(const std::string& name);

/// Whether a name has a number in a form of other programs (%04d, $F4), which no name has by chance.
bool has_foreign_number_sign(const std::string& name);

/// `text` with each sign replaced by the number: "flow.####.vdb" becomes "flow.0007.vdb".
std::string numbered(const std::string& text, int number);

}  // namespace tensorray
