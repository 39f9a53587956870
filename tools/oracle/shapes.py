"""Triangles of simple bodies, outward or along +normal. Needs numpy alone."""

import numpy as np


def quad(corner, along, across, pieces: tuple[int, int] = (1, 1)) -> np.ndarray:
    """A parallelogram with the normal along x across, of 2 x pieces triangles."""
    corner, along, across = (np.asarray(v, float) for v in (corner, along, across))
    triangles = []
    for i in range(pieces[0]):
        for j in range(pieces[1]):
            a = corner + along * (i / pieces[0]) + across * (j / pieces[1])
            b, c, d = a + along / pieces[0], a + along / pieces[0] + across / pieces[1], a + across / pieces[1]
            triangles += [[a, b, c], [a, c, d]]
    return np.array(triangles)


def box(low, high, leave_out: tuple[str, ...] = ()) -> np.ndarray:
    """A box with outward normals; `leave_out` names faces such as "+Z"."""
    (x, y, z), (a, b, c) = low, np.asarray(high, float) - np.asarray(low, float)
    faces = {
        "-X": ([x, y, z], [0, 0, c], [0, b, 0]),
        "+X": ([x + a, y, z], [0, b, 0], [0, 0, c]),
        "-Y": ([x, y, z], [a, 0, 0], [0, 0, c]),
        "+Y": ([x, y + b, z], [0, 0, c], [a, 0, 0]),
        "-Z": ([x, y, z], [0, b, 0], [a, 0, 0]),
        "+Z": ([x, y, z + c], [a, 0, 0], [0, b, 0]),
    }
    return np.concatenate([quad(*face) for name, face in faces.items() if name not in leave_out])


def tube(start, end, radius: float, facets: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """A tube of flat facets around an axis, in rings, with closed ends. Triangles, and smooth normals along its side."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    axis = (end - start) / np.linalg.norm(end - start)
    first = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    angle = np.arange(facets + 1) * 2 * np.pi / facets
    out = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)
    triangles, normals = [], []
    for i in range(facets):
        a, b = start + radius * out[i], start + radius * out[i + 1]
        for ring in range(rings):
            low, high = (end - start) * (ring / rings), (end - start) * ((ring + 1) / rings)
            triangles += [[a + low, b + low, b + high], [a + low, b + high, a + high]]
            normals += [[out[i], out[i + 1], out[i + 1]], [out[i], out[i + 1], out[i]]]
        triangles += [[start, b, a], [end, a + end - start, b + end - start]]
        normals += [[-axis] * 3, [axis] * 3]
    return np.array(triangles), np.array(normals)
