#!/usr/bin/python3
"""Samples the velocity gradient into an OpenVDB tensor field:  flow_to_vdb.py hemisphere_flow.vtu hemisphere_flow.vdb VOXELS

VOXELS: how many along x. Three Vec3S grids velocity_gradient_row0..2, T_ij = d u_i / d x_j in world axes, half floats.
Voxels in the body are inactive. The half y > 0 is sampled and mirrored, so that the field is symmetric to the bit.
Prints what the lattice keeps of the field, and the stored tensor against central differences of the sampled velocity.
"""

import statistics
import struct
import sys

import pyopenvdb

from flow_file import read_flow, sample
from shape import BOX, distance_to_body, lattice
from tensors import MIRRORED, asymmetry, complex_share, difference, norm, transposed

NAME = "velocity_gradient"
METADATA = {
    "tensorray:field": NAME,
    "tensorray:units": "speed of sound / radius",
    "tensorray:source": "OpenFOAM rhoCentralFoam, hemisphere-capped cylinder of radius 1, Mach 1.2, 19 degrees, Re_D 1e4 "
    "(tools/hemisphere_flow)",
}


def sample_half(flow, resolution):
    """{(i, j, k): (T, u)} of the voxels with y > 0 outside the body; T as the halves that are stored."""
    size, counts, first = lattice(resolution)
    indices, points = [], []
    for i in range(counts[0]):
        for j in range(counts[1] // 2, counts[1]):
            for k in range(counts[2]):
                point = tuple(first[a] + size * n for a, n in enumerate((i, j, k)))
                if distance_to_body(*point) > 0:
                    indices.append((i, j, k))
                    points.append(point)
    data, valid = sample(flow, points)
    gradient, velocity = data.GetArray(NAME), data.GetArray("U")
    voxels = {}
    for n, index in enumerate(indices):
        if valid(n):
            halves = struct.pack("<9e", *gradient.GetTuple(n))
            voxels[index] = (struct.unpack("<9e", halves), velocity.GetTuple(n))
    return voxels


def write_grids(path, voxels, resolution):
    size, counts, first = lattice(resolution)
    to_world = [[size, 0, 0, 0], [0, size, 0, 0], [0, 0, size, 0], first + [1]]
    grids = []
    for row in range(3):
        grid = pyopenvdb.Vec3SGrid()
        grid.name = f"{NAME}_row{row}"
        grid.vectorType = "invariant"
        grid.saveFloatAsHalf = True
        grid.transform = pyopenvdb.createLinearTransform(to_world)
        grids.append(grid)
    accessors = [grid.getAccessor() for grid in grids]
    for (i, j, k), (tensor, _) in voxels.items():
        mirrored = [sign * value for sign, value in zip(MIRRORED, tensor)]
        for row, accessor in enumerate(accessors):
            accessor.setValueOn((i, j, k), tuple(tensor[3 * row : 3 * row + 3]))
            accessor.setValueOn((i, counts[1] - 1 - j, k), tuple(mirrored[3 * row : 3 * row + 3]))
    pyopenvdb.write(path, grids, METADATA)


def native_norms(flow):
    """Norms of T at the nodes of the mesh within the box."""
    gradient = flow.GetPointData().GetArray(NAME)
    norms = []
    for n in range(flow.GetNumberOfPoints()):
        point = flow.GetPoint(n)
        if all(BOX[0][a] <= point[a] <= BOX[1][a] for a in range(3)):
            norms.append(norm(gradient.GetTuple(n)))
    return norms


def central_differences(voxels, size, index):
    """The velocity gradient at a voxel from its six neighbours, or None where one is missing."""
    columns = []
    for axis in range(3):
        step = [int(axis == a) for a in range(3)]
        plus = voxels.get(tuple(n + s for n, s in zip(index, step)))
        minus = voxels.get(tuple(n - s for n, s in zip(index, step)))
        if not plus or not minus:
            return None
        columns.append([(p - m) / (2 * size) for p, m in zip(plus[1], minus[1])])
    return [columns[column][row] for row in range(3) for column in range(3)]


def print_differences(voxels, resolution):
    """|T - D| / |T|, D the central differences, of the stronger half of the voxels that are three voxels off the body."""
    size, _, first = lattice(resolution)
    pairs = []
    for index, (tensor, _) in voxels.items():
        if distance_to_body(*(f + size * n for f, n in zip(first, index))) > 3 * size:
            differences = central_differences(voxels, size, index)
            if differences:
                pairs.append((tensor, differences))
    floor = statistics.median(norm(tensor) for tensor, _ in pairs)
    pairs = [pair for pair in pairs if norm(pair[0]) > floor]
    for label, change in (("T", lambda t: t), ("the transpose of T", transposed)):
        errors = [norm(difference(change(t), d)) for t, d in pairs]
        median = statistics.median(error / norm(t) for error, (t, _) in zip(errors, pairs))
        total = norm(errors) / norm([norm(t) for t, _ in pairs])
        print(f"  {label} against differences of the sampled velocity: median {median:.3f}, root mean square {total:.3f} of |T|")


def print_field(voxels, flow):
    tensors = [tensor for tensor, _ in voxels.values()]
    norms = [norm(tensor) for tensor in tensors]
    native = native_norms(flow)
    print(f"  |T| at the voxels: median {statistics.median(norms):.4g}, peak {max(norms):.4g}")
    print(f"  |T| at the mesh's nodes in the box: median {statistics.median(native):.4g}, peak {max(native):.4g}")
    print(f"  asymmetry {asymmetry(tensors):.3f} (0 symmetric, 2 antisymmetric)")
    print(f"  complex eigenvalues in {100 * complex_share(tensors):.1f}% of the voxels")


def main(source, target, resolution):
    flow = read_flow(source)
    resolution = int(resolution)
    voxels = sample_half(flow, resolution)
    write_grids(target, voxels, resolution)
    size, counts, _ = lattice(resolution)
    print(f"{target}: {counts[0]} x {counts[1]} x {counts[2]} voxels of {size:.4g}, {2 * len(voxels)} active")
    print_field(voxels, flow)
    print_differences(voxels, resolution)


if __name__ == "__main__":
    main(*sys.argv[1:])
