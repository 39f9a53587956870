"""Reflections of a planet by Isotherm against Mitsuba 3: plates, a sphere, rough foil and a cube of two materials.

    python -m peer_bench.reflections_mitsuba ISOTHERM FOLDER

ISOTHERM is the program. FOLDER takes its scenes and images. Nothing emits but the planet, a sphere with a radiance of 1.
Mitsuba follows one reflection, as `reflections = "environment"` does. Its rough conductor loses the light of
further reflections between facets, which Isotherm does not: its image is divided by that in a white furnace.
`tools/peers` runs it too. It leaves FOLDER/reflections.json, and ends with 1 where a mean radiance is off by more than 0.5 %.
"""

import json
import struct
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenEXR
from numpy.typing import NDArray

from peer_bench.image_mitsuba import radiance

Array = NDArray[np.float64]

ALTITUDE, RADIUS = 408e3, 6371e3
# The planet of Mitsuba, of the same apparent radius, but near enough for numbers of 32 bits [m].
DISTANCE = 1e5
WIDTH, HEIGHT, FOV_DEG = 160, 120, 30.0
SAMPLES, ALLOWED = 512, 0.005
# Exitance of the planet [W/m2], and the band of the images [m].
PLANET_IR, STEFAN_BOLTZMANN, BAND = 237.0, 5.670374419e-8, [8e-6, 14e-6]


@dataclass(frozen=True)
class Finish:
    """A surface that reflects all: roughness of a mirror, 0 for a smooth one, or nothing for a diffuse one."""

    roughness: float | None

    def rule(self, name: str) -> str:
        """The material in a scene of Isotherm."""
        mirror = "" if self.roughness is None else f"specular = 1.0\nroughness = {self.roughness}\n"
        return (
            f'[[material]]\nmatch = "{name}"\nabsorptivity = 0.1\nemissivity = 1e-6\nsides = "outside"\n'
            f'response = "instant"\n{mirror}'
        )

    def bsdf(self) -> dict:
        """The material in Mitsuba."""
        if self.roughness is None:
            plain = {"type": "diffuse", "reflectance": 1.0}
        elif self.roughness == 0.0:
            plain = {"type": "conductor", "material": "none"}
        else:
            plain = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": self.roughness}
        return {"type": "twosided", "bsdf": plain}


@dataclass(frozen=True)
class Mesh:
    """Triangles of one material."""

    corners: Array
    normals: Array
    triangles: NDArray[np.uint32]


def quad(centre: list[float], right: list[float], up: list[float]) -> Mesh:
    """A square with half-sides `right` and `up`. Its front faces right x up."""
    c, r, u = (np.array(vector, float) for vector in (centre, right, up))
    normal = np.cross(r, u) / np.linalg.norm(np.cross(r, u))
    corners = np.array([c - r - u, c + r - u, c + r + u, c - r + u])
    return Mesh(corners, np.tile(normal, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]], np.uint32))


def joined(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(mesh.corners) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.corners for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]).astype(np.uint32),
    )


def sphere(rows: int = 96, columns: int = 192) -> Mesh:
    """A sphere of radius 1 with the normals of a sphere."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij")
    points = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    at = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    corners = points.reshape(-1, 3)[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    points = points.reshape(-1, 3)
    return Mesh(points, points, triangles[area > 1e-9].astype(np.uint32))


def cube() -> tuple[Mesh, Mesh]:
    """The sides and the ends of a cube of side 1.6."""
    faces, h = [], 0.8
    for axis in range(3):
        for sign in (1.0, -1.0):
            right, up = np.zeros(3), np.zeros(3)
            right[(axis + 1) % 3], up[(axis + 2) % 3] = h, h * sign
            centre = np.zeros(3)
            centre[axis] = sign * h
            faces.append(quad(centre.tolist(), right.tolist(), up.tolist()))
    return joined(faces[:4]), joined(faces[4:])


def plates() -> Mesh:
    """Plates tilted by several angles against nadir (+Z)."""
    tilted = []
    for number, tilt in enumerate(np.radians([0.0, 50.0, 90.0, 130.0])):
        right = 0.6 * np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
        # The front faces the camera's side.
        tilted.append(quad([0.0, 2.2 * number - 3.3, 0.0], right.tolist(), [0.0, 0.6, 0.0]))
    return joined(tilted)


def glb(path: Path, meshes: dict[str, Mesh]) -> None:
    """Writes a model with one part and material for each mesh."""
    blob, views, accessors, primitives = b"", [], [], []

    def add(values: NDArray, kind: int, shape: str, **fields: list[float]) -> int:
        nonlocal blob
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": values.nbytes})
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": kind, "count": values.size // (3 if shape == "VEC3" else 1)}
            | {"type": shape}
            | fields
        )
        blob += values.tobytes()
        return len(accessors) - 1

    for number, mesh in enumerate(meshes.values()):
        corners = mesh.corners.astype(np.float32)
        limits = {"min": corners.min(0).tolist(), "max": corners.max(0).tolist()}
        attributes = {
            "POSITION": add(corners, 5126, "VEC3", **limits),
            "NORMAL": add(mesh.normals.astype(np.float32), 5126, "VEC3"),
        }
        indices = add(mesh.triangles.ravel(), 5125, "SCALAR")
        primitives.append({"attributes": attributes, "indices": indices, "material": number})
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(primitives)))}],
        "nodes": [{"mesh": number, "name": name} for number, name in enumerate(meshes)],
        "meshes": [{"primitives": [primitive]} for primitive in primitives],
        "materials": [{"name": name} for name in meshes],
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


def by_isotherm(program: Path, folder: Path, meshes: dict[str, Mesh], finishes: dict[str, Finish], eye: Array) -> dict:
    """The image, as a share of the planet's radiance, and the part that each pixel shows."""
    folder.mkdir(parents=True, exist_ok=True)
    glb(folder / "model.glb", meshes)
    rules = "".join(finish.rule(name) for name, finish in finishes.items())
    scene = f"""[model]
path = "model.glb"
[time]
step = 1
steps = 1
draw_steps = [0]
[orbit]
altitude = {ALTITUDE}
[attitude]
mode = "nadir"
nadir_axis = "+Z"
forward_axis = "+X"
[environment]
planet_ir = {PLANET_IR}
planet_radius = {RADIUS}
background_temperature = 0
[initial]
temperature = 1
{rules}[radiance]
reflections = "environment"
[output]
channels = ["reflected"]
[camera]
width = {WIDTH}
height = {HEIGHT}
fov_deg = {FOV_DEG}
frame = "body"
position = {eye.tolist()}
look_at = [0, 0, 0]
up = [0, 0, -1]
"""
    (folder / "scene.toml").write_text(scene)
    command = [program, "run", folder / "scene.toml", "-o", folder / "out", "--force"]
    subprocess.run(command, check=True, capture_output=True)
    with OpenEXR.File(str(folder / "out/frames/step_000000.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    planet = radiance(BAND, np.array((PLANET_IR / STEFAN_BOLTZMANN) ** 0.25))
    return {"image": channels["reflected"] / planet, "part": channels["part"]}


def by_mitsuba(meshes: dict[str, Mesh], finishes: dict[str, Finish], eye: Array, furnace: bool) -> Array:
    """The image before a planet of radiance 1, or in a white furnace."""
    to_world = mi.ScalarTransform4f().look_at(origin=eye.tolist(), target=[0, 0, 0], up=[0, 0, -1])
    scene: dict = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True},
        "sensor": {
            "type": "perspective",
            "fov_axis": "x",
            "fov": FOV_DEG,
            "to_world": to_world,
            "sampler": {"type": "independent", "sample_count": SAMPLES},
            "film": {
                "type": "hdrfilm",
                "width": WIDTH,
                "height": HEIGHT,
                "rfilter": {"type": "box"},
                "pixel_format": "luminance",
                "component_format": "float32",
            },
        },
    }
    light = {"type": "uniform", "value": 1.0}
    if furnace:
        scene["sky"] = {"type": "constant", "radiance": light}
    else:
        scene["planet"] = {
            "type": "sphere",
            "center": [0.0, 0.0, DISTANCE],
            "radius": DISTANCE * RADIUS / (RADIUS + ALTITUDE),
            "emitter": {"type": "area", "radiance": light},
        }
    for name, mesh in meshes.items():
        shape = mi.Mesh(name, len(mesh.corners), len(mesh.triangles), has_vertex_normals=True)
        parameters = mi.traverse(shape)
        parameters["vertex_positions"] = mesh.corners.astype(np.float32).ravel()
        parameters["vertex_normals"] = mesh.normals.astype(np.float32).ravel()
        parameters["faces"] = mesh.triangles.ravel()
        parameters.update()
        file = Path(sys.argv[2]) / f"{name}.ply"
        shape.write_ply(str(file))
        scene[name] = {"type": "ply", "filename": str(file), "surface": finishes[name].bsdf()}
    return np.array(mi.render(mi.load_dict(scene), spp=SAMPLES, seed=1), dtype=np.float64)[..., 0]


def inside(part: NDArray, number: int) -> NDArray:
    """Pixels of a part whose eight neighbours show it too."""
    mask = part == number
    for axis in (0, 1):
        mask = mask & np.roll(mask, 1, axis) & np.roll(mask, -1, axis)
    return mask


def main() -> int:
    """Compares every case, prints a line for each, and returns the exit status."""
    program, folder = Path(sys.argv[1]), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    mi.set_variant("llvm_mono" if "llvm_mono" in mi.variants() else "scalar_rgb")
    sides, ends = cube()
    diffuse, smooth = Finish(None), Finish(0.0)
    cases: list[tuple[str, dict[str, Mesh], dict[str, Finish]]] = [
        ("plates, diffuse", {"plates": plates()}, {"plates": diffuse}),
        ("sphere, diffuse", {"ball": sphere()}, {"ball": diffuse}),
        ("sphere, smooth mirror", {"ball": sphere()}, {"ball": smooth}),
        ("cube, diffuse and a mirror of 0.3", {"sides": sides, "ends": ends}, {"sides": diffuse, "ends": Finish(0.3)}),
    ]
    for roughness in (0.05, 0.3, 1.0):
        cases.append((f"plates, roughness {roughness}", {"plates": plates()}, {"plates": Finish(roughness)}))
        cases.append((f"sphere, roughness {roughness}", {"ball": sphere()}, {"ball": Finish(roughness)}))
    missed, rows = 0, []
    for number, (name, meshes, finishes) in enumerate(cases):
        eye = np.array([15.0, 2.0, 6.0]) if "plates" in meshes else np.array([6.0, 1.0, 3.0])
        own = by_isotherm(program, folder / str(number), meshes, finishes, eye)
        planet, white = (by_mitsuba(meshes, finishes, eye, furnace) for furnace in (False, True))
        for part, part_name in enumerate(meshes, start=1):
            mask = inside(own["part"], part) & (white > 0.0)
            other = planet[mask] / white[mask]
            off = own["image"][mask].mean() / other.mean() - 1.0
            local = np.sqrt(np.mean((own["image"][mask] - other) ** 2))
            missed += abs(off) > ALLOWED
            rows.append({"work": f"{name}, {part_name}", "off": float(off), "rms": float(local)})
            print(
                f"{name}, {part_name}: {mask.sum()} pixels, Isotherm {own['image'][mask].mean():.5f}, "
                f"Mitsuba {other.mean():.5f}, off by {100 * off:+.2f} %, rms {local:.4f} of the planet's radiance; "
                f"Mitsuba alone loses {100 * (1 - white[mask].mean()):.1f} %",
                flush=True,
            )
    (folder / "reflections.json").write_text(json.dumps(rows))
    print(f"{missed} beyond {100 * ALLOWED} %")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
