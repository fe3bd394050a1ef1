#pragma once
/// @file scenes/jobs/read_shards.h
/// Puts the shards of a render together.

#include <string>
#include <vector>

#include "scenes/jobs/work_file.h"

namespace tensorray {

/// All units of a render. @param files  Its shards, in any order.
/// @throw std::invalid_argument naming shards that are missing, repeated, incomplete or of another render; as
/// read_work.
WorkFile read_shards(const std::vector<std::string>& files);

}  // namespace tensorray
