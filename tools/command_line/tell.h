#pragma once
/// @file tools/command_line/tell.h
/// Prints what the programs say about their work. What cannot be written (the log's disk is full, its reader has gone)
/// is dropped: no message is worth the work that it is about. What a command was asked for, such as `info`, is printed
/// with fmt::print instead, and is an error where it cannot be written (run_and_report.h).

#include <string>
#include <string_view>
#include <vector>

namespace tensorray {

/// Opens standard streams that are closed, so that no file of the work gets their numbers. Writing to them stays an
/// error. Call it first in a program.
void open_standard_streams();

/// Writes `text` to standard error, as it is.
void print_error(std::string_view text) noexcept;

/// Prints `lines` on standard error, unless `quiet` is set.
void tell(const std::vector<std::string>& lines, bool quiet);

/// Prints a line on standard output that says what was made.
void tell_made(const std::string& line);

}  // namespace tensorray
