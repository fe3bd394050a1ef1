#pragma once
/// @file tools/benchmark/child.h
/// The programs that whole jobs are made with.

#include <filesystem>
#include <string>
#include <vector>

namespace tensorray::benchmark {

/// A program beside this one. @throw std::runtime_error if there is none.
std::filesystem::path sibling(const std::string& program);

/// Runs it to its end. @throw std::runtime_error if it cannot be started or fails; it has said why.
void run_program(const std::filesystem::path& program, const std::vector<std::string>& arguments);

}  // namespace tensorray::benchmark
