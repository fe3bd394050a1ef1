#pragma once
/// @file renderer/color/builtin_config.h
/// The OpenColorIO config that is used where the user has none.

namespace tensorray {

/// An OCIO 2 config as text. It needs no other file, and nothing newer than OpenColorIO 2.1.
extern const char* const builtin_color_config;

}  // namespace tensorray
