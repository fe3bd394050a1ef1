#!/usr/bin/python3
"""Makes the data sets of the flow of what OpenFOAM wrote:

    flow.py vtu internal.vtu hemisphere_flow.vtu            # the whole body from the half, the tensor in our order
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
#: Where the body ends along x: at the end of the sampled box.
END = 6.4
#: Signs of M T M for M = diag(1, -1, 1): the mirror image in the plane y = 0.
MIRRORED = np.array([[1, -1, 1], [-1, 1, -1], [1, -1, 1]])


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


def make_body(target, around=96, rings=24):
    """The body as a closed triangle mesh, out to END; seen anticlockwise from outside."""
    turns = np.pi / 2 * np.arange(1, rings) / rings
    x = np.concatenate([-np.cos(turns), [0, END]])
    radii = np.concatenate([np.sin(turns), [1, 1]])
    angles = 2 * np.pi * np.arange(around) / around
    circles = [np.column_stack([np.full(around, x), r * np.cos(angles), r * np.sin(angles)]) for x, r in zip(x, radii)]
    vertices = np.concatenate([[[-1, 0, 0]], *circles, [[END, 0, 0]]])
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
    {"vtu": make_vtu, "body": make_body}[sys.argv[1]](*sys.argv[2:])
