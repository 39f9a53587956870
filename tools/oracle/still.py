"""Truth of plates without conduction and exchange before a Sun that stands still: every place by itself."""

from dataclasses import dataclass

import numpy as np

from . import gltf, pixels, plates, rays
from .camera import Camera


@dataclass
class Skin:
    """Optics and heat capacity [J/(m2 K)] of a material. `back` is absorptivity and emissivity of the other side."""

    absorptivity: float
    emissivity: float
    capacity: float
    back: tuple[float, float] | None = None


def sun_at(beta_deg: float) -> np.ndarray:
    return np.array([np.cos(np.radians(beta_deg)), 0.0, np.sin(np.radians(beta_deg))])


def rows(parts: list[gltf.Part], skins: dict[str, Skin], camera: Camera, beta_deg: float, initial: float, step: float, steps: list[int], most: int = 1200, only: str | None = None) -> list:
    """Rows of a truth: step, u, v, part, kelvin."""
    triangles = np.concatenate([part.triangles for part in parts])
    part_of = np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts])
    normals = gltf.flat_normals(triangles)
    # Faces of one plane and part are one group: a pixel near an edge of a body may show either face.
    _, group = np.unique(np.column_stack([part_of, np.round(normals, 3), np.round((normals * triangles[:, 0]).sum(1), 4)]), axis=0, return_inverse=True)
    scene = rays.Rays(triangles)
    seen = pixels.seen(camera, scene, group.ravel(), most)
    sun = sun_at(beta_deg)
    normal = normals[seen.triangle]
    skin = [skins[parts[part].material] for part in part_of[seen.triangle]]
    front = np.array([s.absorptivity for s in skin]) * np.maximum(0, normal @ sun) * rays.lit_points(seen.place, normal, sun, scene)
    back = np.array([s.back[0] if s.back else 0.0 for s in skin]) * np.maximum(0, -normal @ sun) * rays.lit_points(seen.place, -normal, sun, scene)
    emissivity = np.array([s.emissivity + (s.back[1] if s.back else 0.0) for s in skin])
    kelvin = plates.temperatures(1361.0 * (front + back), emissivity, np.array([s.capacity for s in skin]), initial, [step * n for n in steps])
    table = []
    for index, number in enumerate(steps):
        for pixel in range(len(seen.u)):
            part = int(part_of[seen.triangle[pixel]])
            if only is None or parts[part].name == only:
                table.append((number, int(seen.u[pixel]), int(seen.v[pixel]), part, float(kelvin[index, pixel])))
    return table
