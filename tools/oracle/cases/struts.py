"""Struts 1 m over light foil, which turns as slowly as a craft in orbit: their shadows, hardly wider than they move in two steps, sweep over the foil. Every place is followed by itself."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, RATE, INITIAL, END = 50.0, 0.065, 280.0, 2400
SKIN = (0.5, 0.85, 900.0)
STRUT = (0.3, 0.8, 3000.0)
PARTS = [
    gltf.Part("panel", "foil", shapes.box([-2, -2, -0.1], [2, 2, 0])),
    *[gltf.Part(f"strut_{k}", "strut", shapes.box([x - 0.03, -2, 0.97], [x + 0.03, 2, 1.03])) for k, x in enumerate((-1.2, -0.3, 0.6, 1.5))],
    gltf.Part("across", "strut", shapes.box([-2, -0.02, 1.05], [2, 0.02, 1.09])),
]
CAMERA = Camera((2.2, -2.6, 4.5), (0.0, 0.0, 0.0), 48.0)
KEPT = (600, 1200, 1800, 2400)


def _sun(time: float) -> tuple[np.ndarray, float]:
    """Direction of the Sun in the body, which turns about +Z, and its flux [W/m2]."""
    turn, beta = np.radians(RATE * time), np.radians(BETA)
    return np.array([np.cos(beta) * np.cos(turn), -np.cos(beta) * np.sin(turn), np.sin(beta)]), 1361.0


def _build(step: int):
    def build(folder: Path) -> Path:
        sky = scenes.still_sun(BETA).replace('mode = "inertial"', f'mode = "spin"\nspin_axis = "+Z"\nrate_deg = {RATE}')
        skins = [scenes.material("foil", *SKIN), scenes.material("strut", *STRUT)]
        time = f"step = {step}\nsteps = {END // step}\ndraw_every = {KEPT[0] // step}\n"
        return scenes.write(folder, PARTS, [sky, "[shadows]", *skins], CAMERA, time, INITIAL, 0.2)

    return build


def _truth(step: int):
    def truth() -> list:
        from .. import pixels, rays
        from ..balance import Finish
        from ..places import followed

        triangles = np.concatenate([part.triangles for part in PARTS])
        part_of = np.repeat(np.arange(len(PARTS)), [len(part.triangles) for part in PARTS])
        normals = gltf.flat_normals(triangles)
        scene = rays.Rays(triangles)
        _, plane = np.unique(np.round(np.column_stack([part_of, normals, (normals * triangles[:, 0]).sum(1)]), 3), axis=0, return_inverse=True)
        seen = pixels.seen(CAMERA, scene, plane.ravel(), 1200)
        own = np.flatnonzero(part_of[seen.triangle] == 0)
        # The light of every 3 s.
        found = followed(seen.place[own], normals[seen.triangle[own]], Finish(*SKIN), scene, _sun, lambda _: 0.0, INITIAL, 15.0, [kept // 15 for kept in KEPT], parts=5, samples=16)
        return [(number * 15 // step, int(seen.u[k]), int(seen.v[k]), 0, float(kelvin)) for number, all_of in found.items() for k, kelvin in zip(own, all_of, strict=True)]

    return truth


FINDS = "shadows of thin struts that pass between two looks at the Sun"
CASES = [
    Case("struts", _build(15), _truth(15), Bounds(rms=0.8), parts=["panel"], finds=FINDS),
    Case("struts_60", _build(60), _truth(60), Bounds(rms=2.0), parts=["panel"], finds=FINDS),
]
