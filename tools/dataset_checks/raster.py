"""Depth of a triangle mesh in numpy. The centre of pixel (i, j) is at (i, j), as in OpenCV."""

import numpy as np

# Pixels that are tried at once.
MOST = 4_000_000


def depth(points: np.ndarray, faces: np.ndarray, camera: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Z of the nearest surface in each pixel, 0 without one. Points are in camera axes, and all lie before the camera."""
    width, height = size
    nearest = np.full(width * height, np.inf)
    seen = points @ camera.T
    u, v, z = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2], points[:, 2]
    faces = faces[(z[faces] > 0).all(axis=1)]
    x, y, inverse = u[faces], v[faces], 1 / z[faces]
    low_x = np.clip(np.ceil(x.min(axis=1)), 0, width).astype(np.int64)
    low_y = np.clip(np.ceil(y.min(axis=1)), 0, height).astype(np.int64)
    high_x = np.clip(np.floor(x.max(axis=1)), -1, width - 1).astype(np.int64)
    high_y = np.clip(np.floor(y.max(axis=1)), -1, height - 1).astype(np.int64)
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    span = np.maximum(high_x - low_x, high_y - low_y) + 1
    used = (high_x >= low_x) & (high_y >= low_y) & (area != 0)
    side = 1
    while used.any():
        group = np.flatnonzero(used & (span <= side))
        used[group] = False
        step = np.arange(side)
        at_once = max(1, MOST // (side * side))
        for first in range(0, len(group), at_once):
            chunk = group[first : first + at_once]
            column = (low_x[chunk][:, None, None] + step[None, None, :]) + 0 * step[None, :, None]
            row = (low_y[chunk][:, None, None] + step[None, :, None]) + 0 * step[None, None, :]
            inside = (column <= high_x[chunk][:, None, None]) & (row <= high_y[chunk][:, None, None])
            total = 0
            for corner in range(3):
                a, b = (corner + 1) % 3, (corner + 2) % 3
                ax, ay, bx, by = (values[chunk][:, None, None] for values in (x[:, a], y[:, a], x[:, b], y[:, b]))
                weight = ((bx - ax) * (row - ay) - (by - ay) * (column - ax)) / area[chunk][:, None, None]
                inside &= weight >= 0
                total = total + weight * inverse[chunk, corner][:, None, None]
            with np.errstate(divide="ignore"):
                np.minimum.at(nearest, (row * width + column)[inside], (1 / total)[inside])
        side *= 2
    nearest[np.isinf(nearest)] = 0
    return nearest.reshape(height, width)
