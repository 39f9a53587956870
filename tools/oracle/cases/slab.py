"""A closed thin slab whose skin exchanges heat on both sides: no sunlight may come in at its edges."""

from pathlib import Path

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 60.0, 290.0, 60.0, 20
PARTS = [gltf.Part("slab", "skin", shapes.box([-2, -1.5, -0.01], [2, 1.5, 0.01]))]
# Seen from below, where no light falls: light that leaks in warms the skin from its inner side.
CAMERA = Camera((2.5, -2.5, -4.5), (0.0, 0.0, 0.0), 45.0)


def _build(max_edge: float):
    def build(folder: Path) -> Path:
        sections = [scenes.still_sun(BETA), "[shadows]", scenes.material("skin", 0.6, 0.8, 2430.0, (0.5, 0.7))]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 10\n", INITIAL, max_edge)

    return build


def _truth() -> list:
    from ..still import Skin, rows

    return rows(PARTS, {"skin": Skin(0.6, 0.8, 2430.0, (0.5, 0.7))}, CAMERA, BETA, INITIAL, STEP, [10, 20])


CASES = [Case(f"slab_{mesh}", _build(edge), _truth, Bounds(largest=0.5), data="slab", parts=["slab"], finds="light that leaks in at edges") for mesh, edge in [("coarse", 2.0), ("fine", 0.25)]]
