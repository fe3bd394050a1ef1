#pragma once
/// Mathematical constants.

namespace tensorray {

constexpr double pi = 3.14159265358979323846;

}  // namespace tensorray
