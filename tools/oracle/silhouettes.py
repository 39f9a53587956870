"""Areas that craft show to a distant Sun, by Embree: the truth of the rule that the lit area vectors of all nodes sum up to the silhouette.

Parallel rays on a fine grid meet the craft. A ray counts where the first face that it meets exchanges heat on that side, or where another face does that lies on the first one:
a sheet of two triangles back to back receives light once, whichever of the two Embree names. `tests/it/silhouette.rs` reads the tables.
"""

import csv
import fnmatch
import tomllib
from pathlib import Path

import numpy as np

from . import gltf
from .rays import Rays, axes

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "oracle"
DIRECTIONS = 100
# Rays along the longer side of the craft's outline.
RAYS = 1500
# Faces this close to each other lie on each other [m].
TOGETHER = 1e-3
# Turns of the ISS's arrays from the file's pose [deg]: joints of `models/iss.toml`, by the pattern of their parts.
TURNS = [(("Body1_ISS_SolarTruss", "Body2_ISS_SolarTruss"), 1, 35.0), (("Body*_ISS_SolarPanel",), 0, -50.0), (("Body*_ISS_SmSolarPanel",), 1, 20.0)]


def directions() -> np.ndarray:
    """Unit vectors, spread evenly over the sphere along a spiral."""
    number = np.arange(DIRECTIONS) + 0.5
    z, angle = 1 - 2 * number / DIRECTIONS, np.pi * (1 + 5**0.5) * number
    across = np.sqrt(1 - z * z)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), z])


def iss_turned(name: str) -> np.ndarray | None:
    """The turn of a node of the ISS, about an axis of its own frame."""
    for patterns, axis, degrees in TURNS:
        if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns):
            sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
            i, j = (axis + 1) % 3, (axis + 2) % 3
            turn = np.eye(3)
            turn[i, i] = turn[j, j] = cosine
            turn[i, j], turn[j, i] = -sine, sine
            return turn
    return None


def both_sides(scene: Path, materials: list[str]) -> list[bool]:
    """Whether each material of a model exchanges heat on both sides."""
    rules = tomllib.loads(scene.read_text())["material"]

    def of(name: str) -> bool:
        for rule in rules:
            patterns = rule["match"] if isinstance(rule["match"], list) else [rule["match"]]
            if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns):
                return rule["sides"] == "both"
        raise AssertionError(f"no rule for {name}")

    return [of(name) for name in materials]


def areas(parts: list[gltf.Part], two: list[bool], rays: int = RAYS) -> np.ndarray:
    """For each direction the area of the silhouette, and the part of it that receives light [m2]."""
    triangles = np.concatenate([part.triangles for part in parts])
    normals = gltf.flat_normals(triangles)
    if any(part.normals is not None for part in parts):
        stated = np.concatenate([part.normals if part.normals is not None else np.repeat(gltf.flat_normals(part.triangles)[:, None], 3, 1) for part in parts])
        # The outside is where the file's normals point, whatever the order of the corners.
        normals *= np.where((normals * stated.sum(1)).sum(1) < 0, -1.0, 1.0)[:, None]
    receives = np.repeat(two, [len(part.triangles) for part in parts])
    scene = Rays(triangles)
    corners = triangles.reshape(-1, 3)
    random = np.random.default_rng(9)
    found = []
    for sun in directions():
        first, second = (axis[0] for axis in axes(sun[None]))
        u, v, far = corners @ first, corners @ second, (corners @ sun).max() + 1.0
        cell = max(np.ptp(u), np.ptp(v)) / rays
        columns, rows = int(np.ceil(np.ptp(u) / cell)) + 1, int(np.ceil(np.ptp(v) / cell)) + 1
        hits = lit = 0
        able = receives | (normals @ sun > 0)
        able_scene = Rays(triangles[able])
        for row in range(0, rows, 128):
            i, j = np.meshgrid(np.arange(columns), np.arange(row, min(row + 128, rows)))
            at = np.column_stack([i.ravel(), j.ravel()]) - 0.5 + random.random((i.size, 2))
            origins = (u.min() + at[:, :1] * cell) * first + (v.min() + at[:, 1:] * cell) * second + far * sun
            hit, far_off = scene.first(origins, np.broadcast_to(-sun, origins.shape))
            hits += int((hit >= 0).sum())
            lit += int(able[hit[hit >= 0]].sum())
            unsure = np.flatnonzero((hit >= 0) & ~able[hit])
            if len(unsure):
                other, distance = able_scene.first(origins[unsure], np.broadcast_to(-sun, (len(unsure), 3)))
                lit += int(((other >= 0) & (distance < far_off[unsure] + TOGETHER)).sum())
        found.append((hits * cell**2, lit * cell**2))
    return np.array(found)


def make() -> None:
    """Writes a table for each craft."""
    DATA.mkdir(parents=True, exist_ok=True)
    craft = [("station", ROOT / "models" / "station.glb", "station.toml", None)]
    iss = ROOT.parent / "shared" / "data" / "models" / "ISS_42.glb"
    craft += [("iss", iss, "iss.toml", None), ("iss_turned", iss, "iss.toml", iss_turned)] if iss.exists() else []
    for name, model, scene, turned in craft:
        parts = gltf.read(model, turned)
        found = areas(parts, both_sides(ROOT / "models" / scene, [part.material for part in parts]))
        with (DATA / f"silhouette_{name}.csv").open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            file.write("# Made by tools/oracle/run silhouettes: unit vector to the Sun (body frame), area of the silhouette and the part of it that receives light [m2]\n")
            writer.writerow(["x", "y", "z", "silhouette", "lit"])
            writer.writerows([f"{value:.9f}" for value in sun] + [f"{value:.4f}" for value in area] for sun, area in zip(directions(), found, strict=True))
        print(f"{name}: silhouette {found[:, 0].min():.1f} to {found[:, 0].max():.1f} m2, lit {found[:, 1].min():.1f} to {found[:, 1].max():.1f}", flush=True)
