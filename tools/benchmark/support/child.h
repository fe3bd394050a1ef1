#pragma once
/// @file tools/benchmark/support/child.h
/// Runs the programs that whole jobs need.

#include <filesystem>
#include <string>
#include <vector>

namespace tensorray::benchmark {

/// The path of a program in the folder of this one. @throw std::runtime_error if it is missing.
std::filesystem::path sibling(const std::string& program);

/// Runs a program and waits for its end. @throw std::runtime_error if it cannot be started or fails; the program itself
/// prints why it failed.
void run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments);

}  // namespace tensorray::benchmark
