#!/usr/bin/python3
"""Writes the body as a closed triangle mesh, out to the end of the sampled box:  body_mesh.py hemisphere_body.ply"""

import math
import struct
import sys

from shape import BOX

AROUND = 96
RINGS = 24


def rings():
    """(x, radius) of the circles from behind the nose to the end; the vertices lie on the body."""
    cap = [(-math.cos(math.pi / 2 * i / RINGS), math.sin(math.pi / 2 * i / RINGS)) for i in range(1, RINGS + 1)]
    return cap[:-1] + [(0.0, 1.0), (BOX[1][0], 1.0)]


def body():
    """(vertices, triangles), seen anticlockwise from outside."""
    circles = rings()
    vertices = [(-1.0, 0.0, 0.0)]
    for x, radius in circles:
        for k in range(AROUND):
            angle = 2 * math.pi * k / AROUND
            vertices.append((x, radius * math.cos(angle), radius * math.sin(angle)))
    vertices.append((BOX[1][0], 0.0, 0.0))
    end = len(vertices) - 1

    def at(ring, k):
        return 1 + ring * AROUND + k % AROUND

    triangles = []
    for k in range(AROUND):
        triangles.append((0, at(0, k + 1), at(0, k)))
        for ring in range(len(circles) - 1):
            a, b, c, d = at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)
            triangles += [(a, b, c), (a, c, d)]
        triangles.append((end, at(len(circles) - 1, k), at(len(circles) - 1, k + 1)))
    return vertices, triangles


def main(path):
    vertices, triangles = body()
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment hemisphere-capped cylinder, radius 1\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        for vertex in vertices:
            file.write(struct.pack("<3f", *vertex))
        for triangle in triangles:
            file.write(struct.pack("<B3i", 3, *triangle))
    print(f"{path}: {len(vertices)} vertices, {len(triangles)} triangles")


if __name__ == "__main__":
    main(*sys.argv[1:])
