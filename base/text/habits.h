#pragma once
/// Names that other renderers have for what a key of a scene does.

#include <string>

namespace tensorray {

/// The key that does what `word` ("fov", "--FOV", "field-of-view") does elsewhere, with its meaning; empty: none.
std::string name_here(const std::string& word);

}  // namespace tensorray
