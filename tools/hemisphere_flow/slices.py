#!/usr/bin/python3
"""Pictures of the flow:  slices.py hemisphere_flow.vtu FOLDER

Mach number, pressure and divergence of the velocity in the plane of symmetry (side_*.png) and across the body at x = 4
(across_*.png, there with the vorticity along x too). The divergence shows staircases of the mesh that Mach number and
pressure hide.
"""

import os
import sys

import vtk

from flow_file import read_flow, sample
from shape import distance_to_body

PIXELS_PER_RADIUS = 60
HEIGHTS = (-5, 6)  # least and greatest z
SIDE, ACROSS = (-4, 10), (-4, 4)  # least and greatest x, and y
RANGES = {"mach": (0, 1.8), "pressure": (0.5, 2.4), "divergence": (-1, 1), "vorticity": (-4, 4)}
COLOURS = ((0.1, 0.1, 0.4), (0.2, 0.6, 0.9), (0.95, 0.95, 0.9), (0.95, 0.6, 0.1), (0.5, 0.05, 0.05))
BODY = (90, 90, 90)


def colour_scale(low, high):
    scale = vtk.vtkColorTransferFunction()
    for n, colour in enumerate(COLOURS):
        scale.AddRGBPoint(low + (high - low) * n / (len(COLOURS) - 1), *colour)
    return scale


def plane(position, abscissas):
    """Where the pixels are, rows from the bottom: (points, width, height)."""
    width = round((abscissas[1] - abscissas[0]) * PIXELS_PER_RADIUS)
    height = round((HEIGHTS[1] - HEIGHTS[0]) * PIXELS_PER_RADIUS)
    points = []
    for row in range(height):
        z = HEIGHTS[0] + (row + 0.5) / PIXELS_PER_RADIUS
        points += [position(abscissas[0] + (column + 0.5) / PIXELS_PER_RADIUS, z) for column in range(width)]
    return points, width, height


def quantities(data):
    """Name -> value at a point of what was sampled."""
    gradient = data.GetArray("velocity_gradient")
    return {
        "mach": data.GetArray("Mach").GetValue,
        "pressure": data.GetArray("p").GetValue,
        "divergence": lambda n: sum(gradient.GetComponent(n, c) for c in (0, 4, 8)),
        "vorticity": lambda n: gradient.GetComponent(n, 7) - gradient.GetComponent(n, 5),
    }


def write_picture(path, scale, values, width, height):
    """A pixel a value; None is the body."""
    image = vtk.vtkImageData()
    image.SetDimensions(width, height, 1)
    image.AllocateScalars(vtk.VTK_UNSIGNED_CHAR, 3)
    pixels = image.GetPointData().GetScalars()
    for n, value in enumerate(values):
        pixels.SetTuple(n, BODY if value is None else [round(255 * c) for c in scale.GetColor(value)])
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputData(image)
    writer.Write()


def main(source, folder):
    flow = read_flow(source)
    views = {
        "side": (plane(lambda x, z: (x, 0.001, z), SIDE), ("mach", "pressure", "divergence")),
        "across": (plane(lambda y, z: (4, y, z), ACROSS), ("mach", "pressure", "divergence", "vorticity")),
    }
    for view, ((points, width, height), names) in views.items():
        data, valid = sample(flow, points)
        outside = [valid(n) and distance_to_body(*point) > 0 for n, point in enumerate(points)]
        for name in names:
            value = quantities(data)[name]
            path = os.path.join(folder, f"{view}_{name}.png")
            values = [value(n) if out else None for n, out in enumerate(outside)]
            write_picture(path, colour_scale(*RANGES[name]), values, width, height)
            print(f"{path}: {RANGES[name][0]} (dark blue) to {RANGES[name][1]} (dark red)")


if __name__ == "__main__":
    main(*sys.argv[1:])
