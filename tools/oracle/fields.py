"""Truth of craft under a Sun that stands still, with conduction or exchange: fields on an own fine mesh, read at pixels."""

import numpy as np

from . import gltf, pixels, rays
from .balance import Absorbed, Balance, Finish
from .camera import Camera
from .lit import sunlight
from .radiosity import Radiosity
from .still import sun_at
from .surface import Surface


def groups(surface: Surface) -> np.ndarray:
    """Numbers of planes of parts."""
    key = np.column_stack([surface.part_of, np.round(surface.normals, 3), np.round((surface.normals * surface.triangles[:, 0]).sum(1), 4)])
    return np.unique(key, axis=0, return_inverse=True)[1].ravel()


def read(surface: Surface, camera: Camera, found: dict[int, np.ndarray], most: int = 1200, only: set[str] | None = None, by_part: bool = False) -> list:
    """Rows of a truth from the fields of some steps. `by_part`: pixels may show several planes of a part."""
    scene = rays.Rays(surface.triangles)
    seen = pixels.seen(camera, scene, surface.part_of if by_part else groups(surface), most)
    table = []
    for number, field in sorted(found.items()):
        kelvin = surface.at(seen.triangle, seen.place, field)
        for pixel in range(len(seen.u)):
            part = int(surface.part_of[seen.triangle[pixel]])
            if only is None or surface.parts[part].name in only:
                table.append((number, int(seen.u[pixel]), int(seen.v[pixel]), part, float(kelvin[pixel])))
    return table


def still(parts: list[gltf.Part], finishes: dict[str, Finish], beta_deg: float, initial: float, step: float, keep: list[int], edge: float, edges: dict[str, float] | None = None, exchange: tuple[float, int] | None = None, samples: int = 64, divide: int = 1):
    """The surface and its fields after some steps. `exchange`: size of patches [m], and rays from each side of a face."""
    surface = Surface(parts, edge, edges)
    balance = Balance(surface, finishes)
    radiosity = Radiosity(surface, balance.side, *exchange) if exchange else None
    absorbed = Absorbed(balance, radiosity)
    print(f"  {len(surface.vertices)} vertices, {len(surface.faces)} faces" + (f", {radiosity.count} patches" if radiosity else ""), flush=True)
    direct = sunlight(surface, balance.side, sun_at(beta_deg), samples)
    light, infrared = absorbed.light(direct, np.zeros_like(direct))
    found = balance.run(initial, step, max(keep), lambda _, kelvin: absorbed.total(light, infrared, kelvin), keep, parts=divide)
    return surface, found
