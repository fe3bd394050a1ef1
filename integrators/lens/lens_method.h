#pragma once
/// @file integrators/lens/lens_method.h
/// The method "lens": an image seen through the field.

#include <memory>

#include "scenes/description/method.h"

namespace tensorray {

std::shared_ptr<Method> lens_method();

}  // namespace tensorray
