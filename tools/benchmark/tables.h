#pragma once
/// @file tools/benchmark/tables.h
/// What was measured, for people.

#include <string>

#include "tools/benchmark/parts.h"

namespace tensorray::benchmark {

/// One text of all parts that `results` holds.
std::string tables(const Json& results);

}  // namespace tensorray::benchmark
