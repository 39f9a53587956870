"""Rays of Embree, and places on the Sun's disc and in triangles."""

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from scipy.stats import qmc

SUN_ANGLE = np.arcsin(6.957e8 / 149_597_870_700.0)


class Rays:
    """Triangles (n, 3, 3) that rays meet, faces on both sides."""

    def __init__(self, triangles: np.ndarray) -> None:
        self.scene = rtcore_scene.EmbreeScene()
        self.triangles = np.ascontiguousarray(triangles, np.float32)
        TriangleMesh(self.scene, self.triangles)

    def first(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Number of the first triangle that each ray meets, -1 for none, and the distance."""
        found = self.scene.run(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32), query="INTERSECT", output=True)
        return found["primID"].astype(int), found["tfar"].astype(float)

    def hidden(self, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Whether each ray meets anything."""
        return self.scene.run(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32), query="OCCLUDED") != -1


def axes(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (n, 3) across unit vectors (n, 3)."""
    other = np.where(np.abs(direction[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(direction, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(direction, first)


def on_the_sun(sun: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Directions to places on the Sun's disc, for numbers (n, 2) in the unit square."""
    radius, angle = np.tan(SUN_ANGLE) * np.sqrt(unit[:, 0]), 2 * np.pi * unit[:, 1]
    first, second = axes(np.broadcast_to(sun, (1, 3)))
    directions = sun + radius[:, None] * (np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def hemisphere(normals: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Directions with the density cosine / pi about unit normals."""
    radius, angle = np.sqrt(unit[:, 0]), 2 * np.pi * unit[:, 1]
    first, second = axes(normals)
    up = np.sqrt(np.maximum(0.0, 1 - unit[:, 0]))
    return radius[:, None] * (np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second) + up[:, None] * normals


def in_triangles(triangles: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Even places in triangles, for numbers (n, 2) in the unit square."""
    root, second = np.sqrt(unit[:, :1]), unit[:, 1:2]
    return (1 - root) * triangles[:, 0] + root * (1 - second) * triangles[:, 1] + root * second * triangles[:, 2]


def numbers(count: int, dimensions: int, seed: int) -> np.ndarray:
    """Scrambled Sobol points."""
    return qmc.Sobol(dimensions, scramble=True, seed=seed).random(1 << (count - 1).bit_length())[:count]


def shares(triangles: np.ndarray, normals: np.ndarray, sun: np.ndarray, rays: Rays, samples: int, offset: float = 1e-4) -> np.ndarray:
    """Lit share of each triangle on the side of its given normal, by rays from places inside it."""
    facing = np.flatnonzero(normals @ sun > 0)
    lit = np.zeros(len(triangles))
    unit = numbers(samples, 4, 7)
    random = np.random.default_rng(11)
    for sample in unit:
        turned = (sample + random.random((len(facing), 4))) % 1.0 if samples < 64 else np.broadcast_to(sample, (len(facing), 4))
        origins = in_triangles(triangles[facing], turned[:, :2]) + offset * normals[facing]
        lit[facing] += ~rays.hidden(origins, on_the_sun(sun, turned[:, 2:]))
    return lit / samples


def lit_points(points: np.ndarray, normals: np.ndarray, sun: np.ndarray, rays: Rays, samples: int = 256, offset: float = 1e-4) -> np.ndarray:
    """Lit share of the Sun's disc at each place, 0 where the normal looks away."""
    facing = np.flatnonzero(normals @ sun > 0)
    lit = np.zeros(len(points))
    for unit in numbers(samples, 2, 5):
        directions = on_the_sun(sun, np.broadcast_to(unit, (len(facing), 2)))
        lit[facing] += ~rays.hidden(points[facing] + offset * normals[facing], directions)
    return lit / samples
