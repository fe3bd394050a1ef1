#pragma once
/// Fields of which a half is stored: their mirror image is the other.

#include "volumes/grids/block_source.h"

namespace tensorray {

/// The metadata of a half: the axis, `x`, `y` or `z`, across which its mirror image lies, in the plane through the
/// origin of the file. Of a field that has been mirrored, the entry is `mirrored_key`.
inline const char* const mirror_key = "tensorray:mirror";
inline const char* const mirrored_key = "tensorray:mirrored";

/// The field that `source.metadata` asks for: with its mirror image M T M, M = diag(1, −1, 1) across y; or as it is.
/// Where both are, the value is their mean. Blocks are still made when they are needed, each from up to three. The
/// surface of the body is mirrored, too, without triangles in the plane.
/// @throw std::invalid_argument, one line: the axis is none, or the plane is neither at voxels nor half-way between,
/// or, of a field with finer levels, not on a face of its bricks.
BlockSource with_mirror_image(BlockSource source);

}  // namespace tensorray
