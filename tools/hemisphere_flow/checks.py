#!/usr/bin/python3
"""Compares the flow with what theory and experience say:  checks.py hemisphere_flow.vtu"""

import math
import sys

from flow_file import read_flow, sample
from shape import INCIDENCE, MACH, distance_to_body

GAMMA = 1.4


def pitot_ratio(mach):
    """Stagnation pressure behind a normal shock over the static pressure before it (Rayleigh)."""
    square = mach * mach
    stagnation = ((GAMMA + 1) ** 2 * square / (4 * GAMMA * square - 2 * (GAMMA - 1))) ** (GAMMA / (GAMMA - 1))
    return stagnation * (1 - GAMMA + 2 * GAMMA * square) / (GAMMA + 1)


def stagnation_pressure(flow):
    """The greatest pressure, and how far from the nose it is, towards the oncoming flow (degrees)."""
    pressure = flow.GetPointData().GetArray("p")
    most = max(range(flow.GetNumberOfPoints()), key=pressure.GetValue)
    x, _, z = flow.GetPoint(most)
    return pressure.GetValue(most), math.degrees(math.atan2(-z, -x))


def stand_off(flow, direction):
    """Distance from the cap to where the pressure has risen half-way to its value behind a normal shock."""
    half_way = 1 + GAMMA / (GAMMA + 1) * (MACH * MACH - 1)
    distances = [0.005 * n for n in range(1, 1200)]
    data, _ = sample(flow, [tuple((1 + d) * component for component in direction) for d in distances])
    pressure = data.GetArray("p")
    return max(d for n, d in enumerate(distances) if pressure.GetValue(n) > half_way)


def vortex(flow, x):
    """The core above the body in the plane at x, y > 0: where the flow across turns fastest, clear of the wall's shear.

    (y, z, vorticity along x, angular speed of the swirl: the imaginary part of the 2x2 gradient's eigenvalues)."""
    points = [(x, 0.02 * i, 0.8 + 0.02 * k) for i in range(1, 100) for k in range(100)]
    points = [point for point in points if distance_to_body(*point) > 0.15]
    data, _ = sample(flow, points)
    gradient = data.GetArray("velocity_gradient")

    def swirl(n):
        yy, yz, zy, zz = (gradient.GetComponent(n, c) for c in (4, 5, 7, 8))
        return math.sqrt(max(0.0, -yz * zy - (yy - zz) ** 2 / 4))

    core = max(range(len(points)), key=swirl)
    vorticity = gradient.GetComponent(core, 7) - gradient.GetComponent(core, 5)
    return points[core][1], points[core][2], vorticity, swirl(core)


def downwash(flow, x):
    """The least velocity along z above the body in the plane of symmetry, and its height; negative between two vortices."""
    points = [(x, 0, 1.01 + 0.01 * n) for n in range(200)]
    data, _ = sample(flow, points)
    velocity = data.GetArray("U")
    least = min(range(len(points)), key=lambda n: velocity.GetComponent(n, 2))
    return velocity.GetComponent(least, 2), points[least][2]


def min_axial_speed(flow):
    """The least velocity along x above the body in the plane of symmetry, and where; negative where the flow is separated."""
    points = [(0.1 * i, 0, 1.02 + 0.02 * k) for i in range(60) for k in range(40)]
    data, _ = sample(flow, points)
    velocity = data.GetArray("U")
    least = min(range(len(points)), key=lambda n: velocity.GetComponent(n, 0))
    return velocity.GetComponent(least, 0), points[least]


def main(path):
    flow = read_flow(path)
    expected = pitot_ratio(MACH)
    pressure, angle = stagnation_pressure(flow)
    print(f"stagnation pressure {pressure:.4f} (Rayleigh pitot {expected:.4f}: {100 * (pressure / expected - 1):+.2f}%), ", end="")
    print(f"{angle:.0f} degrees off the nose (oncoming flow {math.degrees(INCIDENCE):.0f})")
    against = (-math.cos(INCIDENCE), 0, -math.sin(INCIDENCE))
    print(f"bow shock {stand_off(flow, (-1, 0, 0)):.2f} radii before the nose (expected 1.4), ", end="")
    print(f"{stand_off(flow, against):.2f} before the stagnation point")
    speed, (x, _, z) = min_axial_speed(flow)
    print(f"lee side, plane of symmetry: least u {speed:+.3f} at x = {x:.1f}, z = {z:.2f} (negative: separated)")
    for x in (4, 5, 6):
        y, z, vorticity, swirl = vortex(flow, x)
        speed, height = downwash(flow, x)
        print(f"x = {x}: vortices at y = +-{y:.2f}, z = {z:.2f}, ", end="")
        print(f"vorticity along x {vorticity:+.2f} where y > 0, swirl {swirl:.2f}; ", end="")
        print(f"between them w falls to {speed:+.3f} at z = {height:.2f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
