"""A sheet in full sunlight that abuts a box 0.3 m proud of it: no shadow falls on the sheet, whatever the mesh."""

from pathlib import Path

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 50.0, 300.0, 60.0, 20
PARTS = [
    gltf.Part("sheet", "skin", shapes.quad([0, -2, 0], [4, 0, 0], [0, 4, 0])),
    gltf.Part("box", "wall", shapes.box([-2, -2, -0.5], [0, 2, 0.3])),
]
CAMERA = Camera((5.0, -4.0, 5.0), (1.0, 0.0, 0.0), 50.0)


def _build(max_edge: float | str, conducts: float | None):
    def build(folder: Path) -> Path:
        sections = [scenes.still_sun(BETA), "[shadows]", scenes.material("skin", 0.6, 0.8, 2430.0, conducts=conducts), scenes.material("wall", 0.3, 0.85, 4860.0, conducts=conducts)]
        time = f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 10\n"
        return scenes.write(folder, PARTS, sections, CAMERA, time, INITIAL, max_edge)

    return build


def _truth() -> list:
    from ..still import Skin, rows

    # A sheet that is lit evenly conducts nothing, so one truth serves both responses.
    skins = {"skin": Skin(0.6, 0.8, 2430.0), "wall": Skin(0.3, 0.85, 4860.0)}
    return rows(PARTS, skins, CAMERA, BETA, INITIAL, STEP, [10, 20], only="sheet")


CASES = [
    Case(f"abutting_{mesh}_{response}", _build(edge, conducts), _truth, Bounds(largest=1.0), data="abutting", parts=["sheet", "box"], finds="light at vertices: the rim of a part is dark")
    for mesh, edge in [("coarse", '"file"'), ("fine", 0.25)]
    for response, conducts in [("radiative", None), ("network", 0.4)]
]
