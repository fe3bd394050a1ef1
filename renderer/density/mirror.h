#pragma once
/// @file renderer/density/mirror.h
/// Pixels beyond the edges of a picture.

namespace tensorray {

/// Reflects an index into [0, size), as mirrors at the outer edges of the first and last pixel would.
inline int mirror(int index, int size) {
  const int period = 2 * size;
  index = ((index % period) + period) % period;
  return index < size ? index : period - 1 - index;
}

}  // namespace tensorray
