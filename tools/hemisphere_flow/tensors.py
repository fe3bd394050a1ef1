"""3x3 tensors as nine numbers by rows."""

import math

# Signs of the components of M T M for M = diag(1, -1, 1), the mirror image in the plane y = 0.
MIRRORED = (1, -1, 1, -1, 1, -1, 1, -1, 1)


def norm(t):
    return math.sqrt(sum(value * value for value in t))


def difference(a, b):
    return [x - y for x, y in zip(a, b)]


def transposed(t):
    return (t[0], t[3], t[6], t[1], t[4], t[7], t[2], t[5], t[8])


def asymmetry(tensors):
    """sqrt(sum |T - T^t|^2 / sum |T|^2): 0 where symmetric, 2 where antisymmetric."""
    return math.sqrt(sum(norm(difference(t, transposed(t))) ** 2 for t in tensors) / sum(norm(t) ** 2 for t in tensors))


def has_complex_eigenvalues(t):
    """By the discriminant of the characteristic polynomial of the trace-free part, x^3 + p x + q."""
    mean = (t[0] + t[4] + t[8]) / 3
    a, b, c, d, e, f, g, h, i = (t[0] - mean, t[1], t[2], t[3], t[4] - mean, t[5], t[6], t[7], t[8] - mean)
    p = a * e + a * i + e * i - b * d - c * g - f * h
    q = -(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
    return 4 * p**3 + 27 * q**2 > 0


def complex_share(tensors):
    return sum(map(has_complex_eigenvalues, tensors)) / max(1, len(tensors))
