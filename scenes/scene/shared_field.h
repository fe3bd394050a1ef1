#pragma once
/// @file scenes/scene/shared_field.h
/// One copy of a field for all processes of a machine.

#include <functional>
#include <string>

#include "base/process/progress.h"
#include "scenes/scene/scene.h"

namespace tensorray {

/// The field of a scene. Where memory has a bound, processes of one user on one machine that want the same field have
/// one copy of its bricks: the first one loads it, and the others wait, and map its file.
/// @param key  Of the field, and of the program. @throw what `load` throws; Cancelled.
LoadedField share_field(const std::string& key, const std::function<LoadedField()>& load, const Progress& progress);

}  // namespace tensorray
