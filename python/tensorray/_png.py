"""Pictures for notebooks."""

import struct
import zlib

import numpy as np


def encode(display):
    """A picture (height, width, 3 or 4) of values from 0 to 1 as the bytes of an 8-bit PNG."""
    height, width, channels = display.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)  # Each row begins with its filter: none.
    rows[:, 1:] = np.rint(display * 255).reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6 if channels == 4 else 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes())) +
            chunk(b"IEND", b""))
