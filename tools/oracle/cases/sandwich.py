"""Two thin plates close together, cold at first: one is warmed by the Sun alone, the other by the first alone, in steps almost as long as one of them remembers.
What arrives late goes back and forth between them, so the error of infrared that is held for a step grows to many kelvin."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import SIGMA, Bounds, Case

INITIAL, STEP, STEPS, DRAWN = 250.0, 30.0, 10, [3, 5, 10]
# Pixels so far from the middle [m] see the other plate and nothing else, to 5e-5.
MIDDLE = 0.8
# The Sun shines from +X on the back of the roof.
PARTS = [
    gltf.Part("floor", "floor", shapes.quad([0, -2, -2], [0, 4, 0], [0, 0, 4])),
    gltf.Part("roof", "roof", shapes.quad([0.01, -2, -2], [0, 0, 4], [0, 4, 0])),
]
CAMERA = Camera((-12.0, 0.0, 0.0), (0.0, 0.0, 0.0), 24.0)
# Absorptivity and emissivity of the sides that face each other, heat capacity, and the other sides.
FLOOR, ROOF = (0.3, 0.85, 300.0, (0.3, 0.3)), (0.2, 0.9, 600.0, (0.95, 0.1))


def _build(folder: Path) -> Path:
    sections = [scenes.still_sun(0.0), "[shadows]", "[exchange]", scenes.material("floor", *FLOOR), scenes.material("roof", *ROOF)]
    return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_steps = {DRAWN}\n", INITIAL, 0.4)


def _truth() -> list:
    """Grey plates without end exchange sigma (T1^4 - T2^4) / (1/e1 + 1/e2 - 1)."""
    from scipy.integrate import solve_ivp

    from .. import pixels, rays

    def rate(_: float, kelvin: np.ndarray) -> np.ndarray:
        floor, roof = SIGMA * kelvin**4
        passed = (roof - floor) / (1 / FLOOR[1] + 1 / ROOF[1] - 1)
        return np.array([passed - FLOOR[3][1] * floor, 1361.0 * ROOF[3][0] - passed - ROOF[3][1] * roof]) / [FLOOR[2], ROOF[2]]

    times = [STEP * step for step in DRAWN]
    floor = solve_ivp(rate, (0, max(times)), [INITIAL, INITIAL], "DOP853", times, rtol=1e-9, atol=1e-6).y[0]
    seen = pixels.seen(CAMERA, rays.Rays(np.concatenate([part.triangles for part in PARTS])), np.array([0, 0, 1, 1]), 4000)
    inside = np.flatnonzero((np.abs(seen.place[:, 1:]) < MIDDLE).all(1))[::4]
    return [(step, int(seen.u[n]), int(seen.v[n]), 0, kelvin) for step, kelvin in zip(DRAWN, floor, strict=True) for n in inside]


CASES = [Case("sandwich", _build, _truth, Bounds(rms=1.5, largest=4.0), parts=["floor", "roof"], finds="infrared that is held for longer than it takes to go back and forth between plates")]
