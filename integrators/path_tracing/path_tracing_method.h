#pragma once
/// @file integrators/path_tracing/path_tracing_method.h
/// The method "path_tracing": a picture of bent rays as tubes in light.

#include <memory>

#include "scenes/description/method.h"

namespace tensorray {

std::shared_ptr<Method> path_tracing_method();

}  // namespace tensorray
