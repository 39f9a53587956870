"""Rotations as matrices, quaternions and modified Rodrigues parameters."""

import numpy as np


def rotation(sigma: list[float]) -> np.ndarray:
    """The matrix from parent to child axes of modified Rodrigues parameters."""
    s = np.array(sigma)
    cross = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    q = s @ s
    return np.eye(3) + (8 * cross @ cross - 4 * (1 - q) * cross) / (1 + q) ** 2


def quaternion(matrix: np.ndarray) -> np.ndarray:
    """(w, x, y, z) of a rotation matrix."""
    w, x, y, z = (np.sqrt(max(0.0, 1 + s @ np.diag(matrix))) / 2 for s in np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]))
    found = np.array([w, x, y, z])
    largest = int(np.argmax(found))
    m = matrix
    products = {
        0: [w * w, (m[2, 1] - m[1, 2]) / 4, (m[0, 2] - m[2, 0]) / 4, (m[1, 0] - m[0, 1]) / 4],
        1: [(m[2, 1] - m[1, 2]) / 4, x * x, (m[0, 1] + m[1, 0]) / 4, (m[0, 2] + m[2, 0]) / 4],
        2: [(m[0, 2] - m[2, 0]) / 4, (m[0, 1] + m[1, 0]) / 4, y * y, (m[1, 2] + m[2, 1]) / 4],
        3: [(m[1, 0] - m[0, 1]) / 4, (m[0, 2] + m[2, 0]) / 4, (m[1, 2] + m[2, 1]) / 4, z * z],
    }
    return np.array(products[largest]) / found[largest]
