"""Truth of two plates that meet at an edge and see nothing but each other: view factors by Lambert's contour integral, without rays, so pixels close to the edge are right too."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import pixels, rays
from .camera import Camera
from .case import SIGMA


@dataclass
class Plate:
    """A plate from the common edge to `length` [m], both sides of it, its heat capacity [J/(m2 K)] and the flux of the Sun that its back absorbs [W/m2]. The front has `absorptivity`, and the
    Sun shines on all of it with a `direct` flux [W/m2] at a time [s]."""

    length: float
    emissivity: float
    back: float
    capacity: float
    sun: float = 0.0
    absorptivity: float = 1.0
    direct: Callable[[float], float] = lambda _: 0.0


def _edge(points: np.ndarray, normal: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """What lines from `first` to `second` (n, m, 3) add to the integral around what small faces at the points see."""
    a, b = (ends[None] - points[:, None, None] for ends in (first, second))
    across = np.cross(a, b)
    sine = np.sqrt((across * across).sum(-1))
    angle = np.arctan2(sine, (a * b).sum(-1))
    return np.where(sine > 1e-13, (across @ normal) / np.maximum(sine, 1e-300) * angle, 0.0) / (2 * np.pi)


def factors(points: np.ndarray, normal: np.ndarray, along: np.ndarray, grid: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """View factors (points, cells) to the cells of a plate that lies in the direction `along` from the edge, the y axis. A cell counts with its mirror image at -y."""
    total = 0.0
    for sign in (1.0, -1.0):
        corners = grid[0][:, None, None] * along + grid[1][None, :, None] * np.array([0.0, sign, 0.0])
        found = []
        for some in np.array_split(points, max(1, len(points) * corners.shape[0] * corners.shape[1] // 300_000)):
            up, right = _edge(some, normal, corners[:-1], corners[1:]), _edge(some, normal, corners[:, :-1], corners[:, 1:])
            found.append(up[:, :, :-1] + right[:, 1:] - up[:, :, 1:] - right[:, :-1])
        total = total + np.abs(np.concatenate(found))
    return total.reshape(len(points), -1)


def _frames(angle: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Direction and normal of both plates, the first along +x, at an angle [rad] to each other."""
    sine, cosine = np.sin(angle), np.cos(angle)
    return [(np.array([1.0, 0, 0]), np.array([0, 0, 1.0])), (np.array([cosine, 0, sine]), np.array([sine, 0, -cosine]))]


def _leaving(between: list[np.ndarray], own: list[np.ndarray], absorbs: list[float]) -> list[np.ndarray]:
    """What leaves the cells of both plates [W/m2], with all reflections of what they send at first."""
    leaves = own
    for _ in range(60):
        before = leaves
        leaves = [own[n] + (1 - absorbs[n]) * (between[n] @ before[1 - n]) for n in (0, 1)]
        if max(float(np.abs(leaves[n] - before[n]).max()) for n in (0, 1)) < 1e-9:
            break
    return leaves


def temperatures(plates: list[Plate], width: float, angle: Callable[[float], float], knots: np.ndarray, initial: float, step: float, at: dict[int, list[np.ndarray]], cells: tuple[int, int]) -> dict[int, list[np.ndarray]]:
    """Temperatures at places (distance from the edge, |y|) of both plates after some steps. View factors are found at the angles `knots` [rad], which rise. `cells`: along and across half a plate."""
    even = np.linspace(0, 1, cells[0] + 1)
    across = np.linspace(0, 1, cells[1] + 1)
    # Finer towards the edge, and towards the sides.
    grids = [(plate.length * (0.35 * even + 0.65 * even**1.7), 0.25 * width * (across + np.sin(0.5 * np.pi * across))) for plate in plates]
    middles = [np.stack(np.meshgrid(*(0.5 * (lines[1:] + lines[:-1]) for lines in grid), indexing="ij"), -1).reshape(-1, 2) for grid in grids]
    seen = [np.concatenate([pair[n] for pair in at.values()]) for n in (0, 1)]
    first = [len(middle) for middle in middles]

    def found(turn: float) -> list[np.ndarray]:
        frames = _frames(turn)
        places = [np.concatenate([middles[n], seen[n]]) for n in (0, 1)]
        return [factors(places[n][:, :1] * frames[n][0] + places[n][:, 1:] * np.array([0, 1.0, 0]), frames[n][1], frames[1 - n][0], grids[1 - n]) for n in (0, 1)]

    known = [found(turn) for turn in knots]

    def rate(time: float, kelvin: list[np.ndarray]) -> list[np.ndarray]:
        place = float(np.interp(angle(time), knots, np.arange(len(knots))))
        low = min(int(place), max(len(knots) - 2, 0))
        both = [known[low][n] + (place - low) * (known[min(low + 1, len(knots) - 1)][n] - known[low][n]) for n in (0, 1)]
        fourth = [each**4 for each in kelvin]
        inner = [both[n][: first[n]] for n in (0, 1)]
        leaves = _leaving(inner, [plate.emissivity * SIGMA * fourth[n][: first[n]] for n, plate in enumerate(plates)], [plate.emissivity for plate in plates])
        direct = [plate.direct(time) for plate in plates]
        light = [np.zeros(count) for count in first]
        if any(direct):
            light = _leaving(inner, [np.full(first[n], (1 - plate.absorptivity) * direct[n]) for n, plate in enumerate(plates)], [plate.absorptivity for plate in plates])
        return [
            (plate.emissivity * (both[n] @ leaves[1 - n]) + plate.absorptivity * (direct[n] + both[n] @ light[1 - n]) + plate.sun - (plate.emissivity + plate.back) * SIGMA * fourth[n]) / plate.capacity
            for n, plate in enumerate(plates)
        ]

    kelvin = [np.full(first[n] + len(seen[n]), float(initial)) for n in (0, 1)]
    small = min(step, 15.0)
    parts = int(np.ceil(step / small))
    small = step / parts
    table, before = {}, [0, 0]
    for number in range(max(at) * parts):
        time = number * small
        one = rate(time, kelvin)
        two = rate(time + small / 2, [k + small / 2 * r for k, r in zip(kelvin, one, strict=True)])
        three = rate(time + small / 2, [k + small / 2 * r for k, r in zip(kelvin, two, strict=True)])
        four = rate(time + small, [k + small * r for k, r in zip(kelvin, three, strict=True)])
        kelvin = [k + small / 6 * (p + 2 * q + 2 * r + s) for k, p, q, r, s in zip(kelvin, one, two, three, four, strict=True)]
        done = (number + 1) // parts
        if (number + 1) % parts == 0 and done in at:
            ends = [before[n] + len(at[done][n]) for n in (0, 1)]
            table[done] = [kelvin[n][first[n] + before[n] : first[n] + ends[n]].copy() for n in (0, 1)]
            before = ends
    return table


def rows(plates: list[Plate], width: float, angle: Callable[[float], float], knots: np.ndarray, initial: float, step: float, placed: dict[int, np.ndarray], part_of: np.ndarray, camera: Camera, cells: tuple[int, int], most: int, only: set[int]) -> list:
    """Rows of a truth. `placed` has the triangles of the plates at each step, their common edge on the y axis. Two grids, one of half the cells, are extrapolated: errors fall with the square."""
    pixels_of, at = {}, {}
    for number, triangles in sorted(placed.items()):
        seen = pixels.seen(camera, rays.Rays(triangles), part_of, most)
        place = np.stack([np.hypot(seen.place[:, 0], seen.place[:, 2]), np.abs(seen.place[:, 1])], 1)
        part = part_of[seen.triangle]
        pixels_of[number] = (seen, part)
        at[number] = [place[part == n] for n in (0, 1)]
    coarse, fine = (temperatures(plates, width, angle, knots, initial, step, at, (cells[0] // n, cells[1] // n)) for n in (2, 1))
    table, worst = [], 0.0
    for number, (seen, part) in pixels_of.items():
        kelvin = np.zeros(len(part))
        for n in (0, 1):
            change = fine[number][n] - coarse[number][n]
            kelvin[part == n] = fine[number][n] + change / 3
            worst = max(worst, float(np.abs(change).max(initial=0.0)))
        chosen = [k for k in range(len(part)) if int(part[k]) in only]
        table += [(number, int(seen.u[k]), int(seen.v[k]), int(part[k]), float(kelvin[k])) for k in chosen]
    print(f"  {cells[0] * cells[1]} cells a plate; a quarter of them changes pixels by {worst:.2f} K at most", flush=True)
    return table
