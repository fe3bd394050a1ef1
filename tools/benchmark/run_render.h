#pragma once
/// @file tools/benchmark/run_render.h
/// Whole renders, by the program `tensorray` beside this one: what a user waits for.

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/files/temporary_folder.h"

namespace tensorray::bench {

using Json = nlohmann::ordered_json;

/// Runs `tensorray ARGUMENTS...` in the folder. @throw std::runtime_error if it fails; the program prints why.
void run_program(const TemporaryFolder& folder, const std::vector<std::string>& arguments);

/// Renders a scene with `-o` each of the outputs, in the folder. @return the statistics (`--stats`).
Json run_render(const TemporaryFolder& folder, const Json& scene, const std::vector<std::string>& outputs,
                const std::vector<std::string>& options = {});

}  // namespace tensorray::bench
