#!/usr/bin/python3
"""Compares the flow with what theory and experience say:  checks.py hemisphere_flow.vtu"""

import math
import sys

import numpy as np

from flow import INCIDENCE, MACH, NAME, distance_to_body, point_data, read_flow, sample

GAMMA = 1.4


def pitot_ratio(mach):
    """Stagnation pressure behind a normal shock over the static pressure before it (Rayleigh)."""
    square = mach * mach
    stagnation = ((GAMMA + 1) ** 2 * square / (4 * GAMMA * square - 2 * (GAMMA - 1))) ** (GAMMA / (GAMMA - 1))
    return stagnation * (1 - GAMMA + 2 * GAMMA * square) / (GAMMA + 1)


def stagnation_pressure(flow):
    """The greatest pressure, and how far from the nose it is, towards the oncoming flow (degrees)."""
    pressure = point_data(flow, "p")
    x, _, z = flow.GetPoint(int(pressure.argmax()))
    return pressure.max(), math.degrees(math.atan2(-z, -x))


def stand_off(flow, direction):
    """Distance from the cap to where the pressure has risen half-way to its value behind a normal shock."""
    half_way = 1 + GAMMA / (GAMMA + 1) * (MACH * MACH - 1)
    distances = 0.005 * np.arange(1, 1200)
    data, _ = sample(flow, np.outer(1 + distances, direction))
    return distances[point_data(data, "p") > half_way].max()


def vortex(flow, x):
    """The core above the body in the plane at x, y > 0: where the flow across turns fastest, clear of the wall's shear.

    (y, z, vorticity along x, angular speed of the swirl: the imaginary part of the 2x2 gradient's eigenvalues)."""
    points = np.array([(x, 0.02 * i, 0.8 + 0.02 * k) for i in range(1, 100) for k in range(100)])
    points = points[distance_to_body(points) > 0.15]
    across = point_data(sample(flow, points)[0], NAME).reshape(-1, 3, 3)[:, 1:, 1:]
    swirl = np.abs(np.linalg.eigvals(across).imag).max(axis=1)
    core = swirl.argmax()
    return points[core, 1], points[core, 2], across[core, 1, 0] - across[core, 0, 1], swirl[core]


def min_speed(flow, points, axis):
    """The least velocity along an axis, and where."""
    speeds = point_data(sample(flow, points)[0], "U")[:, axis]
    return speeds.min(), points[speeds.argmin()]


def main(path):
    flow = read_flow(path)
    expected = pitot_ratio(MACH)
    pressure, angle = stagnation_pressure(flow)
    print(f"stagnation pressure {pressure:.4f} (Rayleigh pitot {expected:.4f}: {100 * (pressure / expected - 1):+.2f}%), ", end="")
    print(f"{angle:.0f} degrees off the nose (oncoming flow {math.degrees(INCIDENCE):.0f})")
    against = (-math.cos(INCIDENCE), 0, -math.sin(INCIDENCE))
    print(f"bow shock {stand_off(flow, (-1, 0, 0)):.2f} radii before the nose (expected 1.4), ", end="")
    print(f"{stand_off(flow, against):.2f} before the stagnation point")
    # Above the body in the plane of symmetry.
    speed, (x, _, z) = min_speed(flow, [(0.1 * i, 0, 1.02 + 0.02 * k) for i in range(60) for k in range(40)], 0)
    print(f"lee side, plane of symmetry: least u {speed:+.3f} at x = {x:.1f}, z = {z:.2f} (negative: separated)")
    for x in (4, 5, 6):
        y, z, vorticity, swirl = vortex(flow, x)
        speed, (_, _, height) = min_speed(flow, [(x, 0, 1.01 + 0.01 * n) for n in range(200)], 2)
        print(f"x = {x}: vortices at y = +-{y:.2f}, z = {z:.2f}, ", end="")
        print(f"vorticity along x {vorticity:+.2f} where y > 0, swirl {swirl:.2f}; ", end="")
        print(f"between them w falls to {speed:+.3f} at z = {height:.2f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
