#pragma once
/// @file integrators/methods/methods.h
/// The list of all methods.

#include "scenes/description/description.h"

namespace tensorray {

/// A description with the defaults of all methods. A scene file is then read into it.
SceneDescription default_scene();

}  // namespace tensorray
