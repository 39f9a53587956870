"""Truth at places of surfaces without conduction: each place has its own balance, with rays to the Sun, so no mesh smears the edge of a shadow."""

from collections.abc import Callable

import numpy as np

from . import gltf, pixels
from .balance import Finish
from .camera import Camera
from .case import SIGMA
from .rays import Rays, lit_points


def barycentric(triangles: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Weights (n, 3) of the corners of triangles (n, 3, 3) at a place on each."""
    a, b, c = triangles.transpose(1, 0, 2)
    full = np.cross(b - a, c - a)
    norm = (full * full).sum(1)
    second = (np.cross(places - a, c - a) * full).sum(1) / norm
    third = (np.cross(b - a, places - a) * full).sum(1) / norm
    return np.column_stack([1 - second - third, second, third])


def planet_light(
    normals: np.ndarray, down: np.ndarray, angular: float, suns: np.ndarray, rings: int = 96, behind: tuple[np.ndarray, Rays] | None = None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """View factors of plates (n) to a sphere, and the same weighted with the cosine of each Sun (m) on the sphere (m, n), summed over even pieces of its disc.
    `behind`: places of the plates, and triangles that hide the sphere."""
    cosine = 1 - (1 - np.cos(angular)) * (np.arange(rings) + 0.5) / rings
    turn = 2 * np.pi * (np.arange(2 * rings) + 0.5) / (2 * rings)
    first = np.cross(down, [1.0, 0.0, 0.0] if abs(down[0]) < 0.7 else [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    around = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(down, first)
    to = (cosine[:, None, None] * down + np.sqrt(1 - cosine**2)[:, None, None] * around).reshape(-1, 3)
    piece = 2 * np.pi * (1 - np.cos(angular)) / len(to)
    # Distances in units of the orbit's radius.
    along, sine = to @ down, np.sin(angular)
    outward = ((along - np.sqrt(np.maximum(0.0, sine**2 - 1 + along**2)))[:, None] * to - down) / sine
    seen = np.maximum(0.0, to @ normals.T) * piece / np.pi
    if behind is not None:
        places, scene = behind
        for direction, row in zip(to, seen, strict=True):
            facing = np.flatnonzero(row > 0)
            row[facing[scene.hidden(places[facing] + 1e-4 * normals[facing], np.broadcast_to(direction, (len(facing), 3)))]] = 0
    return seen.sum(0), np.array([np.maximum(0.0, outward @ sun) @ seen for sun in suns])


def followed(
    places: np.ndarray, normals: np.ndarray, finish: Finish, scene: Rays, sun: Callable[[float], tuple[np.ndarray, float]], other: Callable[[float], np.ndarray], initial: float, step: float, keep: list[int], parts: int = 4, samples: int = 16,
) -> dict[int, np.ndarray]:  # fmt: skip
    """Temperatures of places after some steps. `sun`: direction and flux [W/m2] at a time; `other`: what else a place absorbs [W/m2]. Outside faces alone."""
    emittance, stored, _ = finish.over or (0.0, 1.0, 0.0)
    kelvin, below = np.full(len(places), initial), np.full(len(places), initial)
    found = {}
    length = step / parts
    for number in range(max(keep) * parts):
        # Light of the middle of each part, and a fourth-order step.
        time = (number + 0.5) * length
        direction, flux = sun(time)
        lit = lit_points(places, normals, direction, scene, samples) if flux > 0 else np.zeros(len(places))
        load = finish.absorptivity * flux * lit * np.maximum(0.0, normals @ direction) + other(time)

        def rate(now: np.ndarray, load: np.ndarray = load) -> np.ndarray:
            return (load - finish.emissivity * SIGMA * now**4 + emittance * SIGMA * (below**4 - now**4)) / finish.capacity

        a = rate(kelvin)
        b = rate(kelvin + 0.5 * length * a)
        c = rate(kelvin + 0.5 * length * b)
        d = rate(kelvin + length * c)
        before, kelvin = kelvin, kelvin + length / 6 * (a + 2 * b + 2 * c + d)
        below = below + length * emittance * SIGMA * (before**4 - below**4) / stored
        if (number + 1) % parts == 0 and (number + 1) // parts in keep:
            found[(number + 1) // parts] = kelvin.copy()
    return found


def followed_in_pixels(
    parts: list[gltf.Part], finishes: dict[str, Finish], camera: Camera, sun: Callable[[float], tuple[np.ndarray, float]], initial: float, step: float, keep: list[int], pieces: int, only: set[str] | None = None,
) -> list[tuple[int, int, int, int, float]]:  # fmt: skip
    """Rows of a table for the pixels that see parts, all or these `only`, each place followed by itself under the Sun alone, in `pieces` of a step."""
    triangles = np.concatenate([part.triangles for part in parts])
    part_of = np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts])
    normals = gltf.flat_normals(triangles)
    scene = Rays(triangles)
    _, plane = np.unique(np.round(np.column_stack([part_of, normals, (normals * triangles[:, 0]).sum(1)]), 3), axis=0, return_inverse=True)
    seen = pixels.seen(camera, scene, plane.ravel(), 1200)
    table = []
    for number, part in enumerate(parts):
        if only is not None and part.name not in only:
            continue
        own = np.flatnonzero(part_of[seen.triangle] == number)
        found = followed(seen.place[own], normals[seen.triangle[own]], finishes[part.material], scene, sun, lambda _: 0.0, initial, step, keep, parts=pieces, samples=16)
        table += [(kept, int(seen.u[k]), int(seen.v[k]), number, float(kelvin)) for kept, all_of in found.items() for k, kelvin in zip(own, all_of, strict=True)]
    return table
