"""A craft of a few large triangles, as programs for drawing write it: a body, a thin panel on an arm, and a sheet whose shadow leaves a crescent of light on the lid below it."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 25.0, 280.0, 30.0, 60
FACETS, RADIUS = 8, 0.6


def _body() -> np.ndarray:
    """A prism about the z axis: two triangles for each side, and lids without a middle."""
    turn = np.arange(FACETS + 1) * 2 * np.pi / FACETS
    low, high = (np.column_stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), np.full(FACETS + 1, z)]) for z in (-1.0, 1.0))
    sides = [[[low[k], low[k + 1], high[k + 1]], [low[k], high[k + 1], high[k]]] for k in range(FACETS)]
    lids = [[[high[0], high[k], high[k + 1]], [low[0], low[k + 1], low[k]]] for k in range(1, FACETS - 1)]
    return np.concatenate([np.array(sides).reshape(-1, 3, 3), np.array(lids).reshape(-1, 3, 3)])


PARTS = [
    gltf.Part("body", "paint", _body()),
    gltf.Part("panel", "cells", shapes.box([0.8, -0.5, -0.02], [3.0, 0.5, 0.02])),
    gltf.Part("arm", "black", shapes.box([0.6, -0.05, -0.05], [0.8, 0.05, 0.05])),
    gltf.Part("sheet", "sheet", shapes.quad([-0.9, -0.9, 1.3], [1.8, 0, 0], [0, 1.8, 0])),
]
SKINS = {"paint": (0.3, 0.85, 2500.0), "cells": (0.8, 0.8, 3000.0), "black": (0.95, 0.9, 4000.0), "sheet": (0.4, 0.7, 1500.0, (0.2, 0.6))}
CONDUCTS = 0.3
CAMERA = Camera((4.0, -5.0, 3.0), (0.7, 0.0, 0.2), 40.0)


def _build(folder: Path) -> Path:
    skins = [scenes.material(name, *skin, conducts=CONDUCTS) for name, skin in SKINS.items()]
    time = f"step = {STEP}\nsteps = {STEPS}\ndraw_steps = [10, 60]\n"
    return scenes.write(folder, PARTS, [scenes.still_sun(BETA), "[shadows]", "[exchange]", *skins], CAMERA, time, INITIAL, None)


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    finishes = {name: Finish(*skin, conducts=CONDUCTS) for name, skin in SKINS.items()}
    surface, found = still(PARTS, finishes, BETA, INITIAL, STEP, [10, 60], 0.05, exchange=(0.06, 512), samples=64, divide=2)
    return read(surface, CAMERA, found)


FINDS = "nodes of the file's few triangles, and light that a patch sends from one side of it"
CASES = [Case("plain", _build, _truth, Bounds(rms=0.3, largest=1.5), parts=[part.name for part in PARTS], finds=FINDS)]
