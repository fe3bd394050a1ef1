#!/usr/bin/python3
"""Makes the data set of what foamToVTK wrote: the whole body from the half, the tensor in the order of this project.

    foam_to_vtu.py internal.vtu hemisphere_flow.vtu

In:  the half y >= 0, point arrays U, grad(U), p, rho, Ma. OpenFOAM's grad(U)_ij is d u_j / d x_i.
Out: both halves, point arrays U, velocity_gradient (T_ij = d u_i / d x_j, nine components by rows), p, rho, Mach.
"""

import sys

import vtk

from flow_file import read_flow, write_flow
from tensors import MIRRORED

TRANSPOSED = (0, 3, 6, 1, 4, 7, 2, 5, 8)


def copy_array(source, name, order, signs):
    """The tuples of `source`, components reordered; then the same times `signs`: those of the mirror image."""
    tuples = source.GetNumberOfTuples()
    result = vtk.vtkFloatArray()
    result.SetName(name)
    result.SetNumberOfComponents(len(order))
    result.SetNumberOfTuples(2 * tuples)
    for i in range(tuples):
        values = source.GetTuple(i)
        values = [values[component] for component in order]
        result.SetTuple(i, values)
        result.SetTuple(tuples + i, [sign * value for sign, value in zip(signs, values)])
    return result


def both_halves(half):
    """Mesh only: the points and cells of `half`, then their mirror images, their points in a valid order."""
    reflection = vtk.vtkReflectionFilter()
    reflection.SetInputData(half)
    reflection.SetPlaneToY()
    reflection.SetCenter(0)
    reflection.CopyInputOn()
    reflection.Update()
    whole = vtk.vtkUnstructuredGrid()
    whole.CopyStructure(reflection.GetOutput())
    return whole


def main(source, target):
    half = read_flow(source)
    data = half.GetPointData()
    whole = both_halves(half)
    result = whole.GetPointData()
    result.AddArray(copy_array(data.GetArray("U"), "U", (0, 1, 2), (1, -1, 1)))
    result.AddArray(copy_array(data.GetArray("grad(U)"), "velocity_gradient", TRANSPOSED, MIRRORED))
    for name, new_name in (("p", "p"), ("rho", "rho"), ("Ma", "Mach")):
        result.AddArray(copy_array(data.GetArray(name), new_name, (0,), (1,)))
    write_flow(target, whole)
    print(f"{target}: {whole.GetNumberOfCells()} cells, {whole.GetNumberOfPoints()} points, both halves")


if __name__ == "__main__":
    main(*sys.argv[1:])
