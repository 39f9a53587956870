"""Sunlight that arrives on the sides of faces [W/m2]."""

import numpy as np

from .radiosity import Side
from .rays import Rays, shares
from .surface import Surface


def sunlight(surface: Surface, side: Side, sun: np.ndarray, samples: int, scene: Rays | None = None, triangles: np.ndarray | None = None, flux: float = 1361.0) -> np.ndarray:
    """By rays from places inside every face to places on the Sun's disc."""
    placed = surface.triangles if triangles is None else triangles
    normals = np.cross(placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    out = normals[side.face] * side.sign[:, None]
    lit = shares(placed[side.face], out, sun, scene or Rays(placed), samples)
    return flux * lit * np.maximum(0.0, out @ sun)
