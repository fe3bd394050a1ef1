#pragma once
/// @file renderer/color/builtin_config.h
/// The OpenColorIO config that is used if the user gives none.

namespace tensorray {

/// An OCIO 2 config as text. It refers to no other file and needs no OpenColorIO newer than 2.1.
extern const char* const builtin_color_config;

}  // namespace tensorray
