"""Small dense linear algebra on lists."""

import math

from .stepper import Vector


def solve(matrix: list[Vector], right: Vector) -> Vector:
    """Gaussian elimination with row pivoting; NaN where the matrix is singular."""
    n = len(right)
    rows = [[*line, value] for line, value in zip(matrix, right, strict=True)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda j: abs(rows[j][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        if not abs(rows[k][k]) > 0.0:
            return [math.nan] * n
        for j in range(k + 1, n):
            factor = rows[j][k] / rows[k][k]
            rows[j] = [a - factor * b for a, b in zip(rows[j], rows[k], strict=True)]
    x = [0.0] * n
    for k in reversed(range(n)):
        x[k] = (rows[k][n] - sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x


def dot(left: Vector, right: Vector) -> float:
    return sum(a * b for a, b in zip(left, right, strict=True))


def fit_columns(columns: list[Vector], data: Vector) -> Vector:
    """Least squares by the normal equations of columns scaled to unit length."""
    lengths = [math.sqrt(dot(column, column)) or 1.0 for column in columns]
    scaled = [[value / length for value in column] for column, length in zip(columns, lengths, strict=True)]
    found = solve([[dot(a, b) for b in scaled] for a in scaled], [dot(a, data) for a in scaled])
    return [value / length for value, length in zip(found, lengths, strict=True)]
