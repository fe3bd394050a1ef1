#pragma once
/// @file integrators/scene/scene_method.h
/// The method "scene": surfaces lit by light that the field bends, seen by a camera whose rays it bends, too.

#include <memory>

#include "scenes/description/method.h"

namespace tensorray {

std::shared_ptr<Method> scene_method();

}  // namespace tensorray
