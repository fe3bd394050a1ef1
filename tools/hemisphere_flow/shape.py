"""The body and the box: a hemisphere-capped cylinder of radius 1 along x, the sphere's centre at the origin.

Lengths are radii; the nose is at x = -1; the plane of symmetry is y = 0; the flow comes from -x and -z, so +z is the lee side.
"""

import math

MACH = 1.2
INCIDENCE = math.radians(19)

# The sampled box, least and greatest corner: the bow shock over the cap, the front of the body and its lee side.
BOX = ((-3.2, -2.8, -2.2), (6.4, 2.8, 3.4))


def distance_to_body(x, y, z):
    """Negative inside."""
    return math.hypot(min(x, 0.0), y, z) - 1


def lattice(resolution):
    """Cubic voxels, `resolution` of them along x, an even number across: (size, counts, centre of the first voxel)."""
    size = round((BOX[1][0] - BOX[0][0]) / resolution, 12)
    counts = [resolution] + [2 * max(1, round((BOX[1][a] - BOX[0][a]) / size / 2)) for a in (1, 2)]
    middle = [(BOX[0][a] + BOX[1][a]) / 2 for a in range(3)]
    first = [round(middle[a] - (counts[a] - 1) / 2 * size, 12) for a in range(3)]
    return size, counts, first
