#!/usr/bin/python3
"""Makes the data sets of the flow of what OpenFOAM wrote:

    flow.py vtu internal.vtu hemisphere_flow.vtu            # the whole body from the half, the tensor in our order
    flow.py vdb hemisphere_flow.vtu hemisphere_flow.vdb N   # N voxels along x; prints what the lattice keeps
    flow.py body hemisphere_body.ply

The body is a hemisphere-capped cylinder of radius 1 along x, the sphere's centre at the origin. Lengths are radii; the
nose is at x = -1; the plane of symmetry is y = 0; the flow comes from -x and -z, so +z is the lee side. Data sets have
the velocity gradient T_ij = d u_i / d x_j in world axes.
"""

import math
import os
import sys

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

MACH = 1.2
INCIDENCE = math.radians(19)
NAME = "velocity_gradient"
#: The sampled box, least and greatest corner: the bow shock over the cap, the front of the body and its lee side.
BOX = np.array([[-3.2, -2.8, -2.2], [6.4, 2.8, 3.4]])
#: Signs of M T M for M = diag(1, -1, 1): the mirror image in the plane y = 0.
MIRRORED = np.array([[1, -1, 1], [-1, 1, -1], [1, -1, 1]])
METADATA = {
    "tensorray:field": NAME,
    "tensorray:units": "speed of sound / radius",
    "tensorray:source": "OpenFOAM rhoCentralFoam, hemisphere-capped cylinder of radius 1, Mach 1.2, 19 degrees, Re_D 1e4 "
    "(tools/hemisphere_flow)",
}


def read_flow(path):
    """An unstructured mesh with point data."""
    if not os.path.isfile(path):
        sys.exit(f"{path}: no such file; tools/hemisphere_flow/run makes it")
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    if reader.GetOutput().GetNumberOfPoints() == 0:
        sys.exit(f"{path}: no mesh in it; delete it and run tools/hemisphere_flow/run again")
    return reader.GetOutput()


def point_data(flow, name):
    return vtk_to_numpy(flow.GetPointData().GetArray(name))


def sample(flow, points):
    """The data set of `points` with the flow's point data, trilinear within the cells, and which lie in the mesh."""
    positions = vtk.vtkPoints()
    positions.SetData(numpy_to_vtk(np.array(points, float), deep=True))
    cloud = vtk.vtkPolyData()
    cloud.SetPoints(positions)
    probe = vtk.vtkProbeFilter()
    probe.SetInputData(cloud)
    probe.SetSourceData(flow)
    probe.Update()
    return probe.GetOutput(), point_data(probe.GetOutput(), probe.GetValidPointMaskArrayName()) == 1


def distance_to_body(points):
    """Negative inside."""
    return np.linalg.norm(np.minimum(points, [0, np.inf, np.inf]), axis=-1) - 1


def norms(tensors):
    return np.linalg.norm(tensors, axis=(-2, -1))


def transposed(tensors):
    return np.swapaxes(tensors, -2, -1)


def make_vtu(source, target):
    """Both halves, point arrays U, velocity_gradient, p, rho, Mach. OpenFOAM's grad(U)_ij is d u_j / d x_i."""
    half = read_flow(source)
    reflection = vtk.vtkReflectionFilter()
    reflection.SetInputData(half)
    reflection.SetPlaneToY()
    reflection.SetCenter(0)
    reflection.CopyInputOn()
    reflection.Update()
    whole = vtk.vtkUnstructuredGrid()
    whole.CopyStructure(reflection.GetOutput())
    tensors = transposed(point_data(half, "grad(U)").reshape(-1, 3, 3))
    arrays = {"U": (point_data(half, "U"), (1, -1, 1)), NAME: (tensors, MIRRORED), "p": (point_data(half, "p"), 1),
              "rho": (point_data(half, "rho"), 1), "Mach": (point_data(half, "Ma"), 1)}
    for name, (values, signs) in arrays.items():
        both = np.concatenate([values, values * signs]).astype(np.float32)
        array = numpy_to_vtk(both.reshape(len(both), -1), deep=True)
        array.SetName(name)
        whole.GetPointData().AddArray(array)
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(target)
    writer.SetInputData(whole)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    if not writer.Write():
        sys.exit(f"{target}: cannot be written")
    print(f"{target}: {whole.GetNumberOfCells()} cells, {whole.GetNumberOfPoints()} points, both halves")


def make_vdb(source, target, resolution):
    """Three Vec3S grids velocity_gradient_row0..2, half floats. Voxels in the body are inactive. The half y > 0 is
    sampled and mirrored, so that the field is symmetric to the bit."""
    import pyopenvdb
    flow, count = read_flow(source), int(resolution)
    size = round((BOX[1, 0] - BOX[0, 0]) / count, 12)
    counts = [count] + [2 * max(1, round((BOX[1, a] - BOX[0, a]) / size / 2)) for a in (1, 2)]  # Cubic voxels.
    first = [round(BOX[:, a].mean() - (counts[a] - 1) / 2 * size, 12) for a in range(3)]
    indices = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1)[:, counts[1] // 2:]
    points = first + size * indices
    data, is_flow = sample(flow, points.reshape(-1, 3))
    is_flow = is_flow.reshape(points.shape[:3]) & (distance_to_body(points) > 0)
    T = point_data(data, NAME).reshape(*points.shape, 3).astype(np.float16).astype(float)  # As they are stored.
    u = point_data(data, "U").reshape(points.shape)

    tensors = np.where(is_flow[..., None, None], T, 0)
    tensors = np.concatenate([(MIRRORED * tensors)[:, ::-1], tensors], axis=1)
    grids = []
    for row in range(3):
        grid = pyopenvdb.Vec3SGrid()
        grid.copyFromArray(np.ascontiguousarray(tensors[..., row, :], np.float32))  # Zeros are inactive.
        grid.name, grid.vectorType, grid.saveFloatAsHalf = f"{NAME}_row{row}", "invariant", True
        grid.transform = pyopenvdb.createLinearTransform(
            [[size, 0, 0, 0], [0, size, 0, 0], [0, 0, size, 0], [*first, 1]])
        grids.append(grid)
    pyopenvdb.write(target, grids, METADATA)
    print(f"{target}: {' x '.join(map(str, counts))} voxels of {size:.4g}, {2 * is_flow.sum()} active")
    print_field(T[is_flow], flow)
    print_differences(T, u, is_flow, distance_to_body(points) > 3 * size, size)


def print_field(T, flow):
    positions = vtk_to_numpy(flow.GetPoints().GetData())
    nodes = norms(point_data(flow, NAME).reshape(-1, 3, 3)[((positions >= BOX[0]) & (positions <= BOX[1])).all(axis=1)])
    asymmetry = math.sqrt((norms(T - transposed(T)) ** 2).sum() / (norms(T) ** 2).sum())
    is_complex = (np.abs(np.linalg.eigvals(T).imag) > 0).any(axis=-1)
    print(f"  |T| at the voxels: median {np.median(norms(T)):.4g}, peak {norms(T).max():.4g}")
    print(f"  |T| at the mesh's nodes in the box: median {np.median(nodes):.4g}, peak {nodes.max():.4g}")
    print(f"  asymmetry {asymmetry:.3f} (0 symmetric, 2 antisymmetric)")
    print(f"  complex eigenvalues in {100 * is_complex.mean():.1f}% of the voxels")


def print_differences(T, u, is_flow, is_clear, size):
    """|T - D| / |T|, D the central differences, of the stronger half of the voxels that are three voxels off the body."""
    inner = (slice(1, -1),) * 3
    steps = [tuple(slice(1 + sign * (a == b), u.shape[b] - 1 + sign * (a == b)) for b in range(3))
             for a in range(3) for sign in (1, -1)]
    use = is_flow[inner] & is_clear[inner] & np.all([is_flow[step] for step in steps], axis=0)
    D = np.stack([(u[steps[2 * a]] - u[steps[2 * a + 1]])[use] / (2 * size) for a in range(3)], axis=-1)
    T = T[inner][use]
    strong = norms(T) > np.median(norms(T))
    D, T = D[strong], T[strong]
    for label, tensors in (("T", T), ("the transpose of T", transposed(T))):
        errors = norms(tensors - D)
        total = math.sqrt((errors**2).sum() / (norms(T) ** 2).sum())
        print(f"  {label} against differences of the sampled velocity: median {np.median(errors / norms(T)):.3f}, "
              f"root mean square {total:.3f} of |T|")


def make_body(target, around=96, rings=24):
    """The body as a closed triangle mesh, out to the end of the sampled box; seen anticlockwise from outside."""
    turns = np.pi / 2 * np.arange(1, rings) / rings
    x = np.concatenate([-np.cos(turns), [0, BOX[1, 0]]])
    radii = np.concatenate([np.sin(turns), [1, 1]])
    angles = 2 * np.pi * np.arange(around) / around
    circles = [np.column_stack([np.full(around, x), r * np.cos(angles), r * np.sin(angles)]) for x, r in zip(x, radii)]
    vertices = np.concatenate([[[-1, 0, 0]], *circles, [[BOX[1, 0], 0, 0]]])
    triangles = []
    for k in range(around):
        here, there = (1 + np.arange(len(x)) * around + side % around for side in (k, k + 1))
        triangles.append((0, there[0], here[0]))
        for a, b, c, d in zip(here, there, there[1:], here[1:]):
            triangles += [(a, b, c), (a, c, d)]
        triangles.append((len(vertices) - 1, here[-1], there[-1]))
    faces = np.empty(len(triangles), [("count", "u1"), ("indices", "<i4", 3)])
    faces["count"], faces["indices"] = 3, triangles
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment hemisphere-capped cylinder, radius 1\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with open(target, "wb") as file:
        file.write(header.encode() + vertices.astype("<f4").tobytes() + faces.tobytes())
    print(f"{target}: {len(vertices)} vertices, {len(triangles)} triangles")


if __name__ == "__main__":
    {"vtu": make_vtu, "vdb": make_vdb, "body": make_body}[sys.argv[1]](*sys.argv[2:])
