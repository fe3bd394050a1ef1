#pragma once
/// @file tools/benchmark/measures/tables.h
/// Prints measurements as readable tables.

#include <string>

#include "tools/benchmark/measures/parts.h"

namespace tensorray::benchmark {

/// The tables of all parts in `results`, as one text.
std::string tables(const Json& results);

}  // namespace tensorray::benchmark
