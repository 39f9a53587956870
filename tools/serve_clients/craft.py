"""A small craft as glTF, and a scene of it whose orbit and attitude stand in tables."""

import base64
import json
from pathlib import Path

import numpy as np

START = "2019-01-01T00:00:00Z"
STEP = 10.0

# Centre and half lengths [m] of boxes of the body frame.
BOXES = {"body": ((0, 0, 0), (1.0, 1.0, 1.5)), "wing": ((0, 3.2, 0), (0.8, 2.0, 0.05)), "boom": ((-2.2, 0, 0.8), (1.2, 0.1, 0.1))}
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def key_points() -> dict[str, np.ndarray]:
    """Corners of the boxes in the body frame [m]."""
    return {f"{name} {i}": np.array(centre) + CORNERS[i] * half for name, (centre, half) in BOXES.items() for i in range(8)}


def _gltf() -> dict:
    data, views, accessors, meshes, nodes = b"", [], [], [], []

    def accessor(array: np.ndarray, kind: str, component: int, **more: list) -> int:
        nonlocal data
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind, **more})
        data += array.tobytes()
        return len(accessors) - 1

    for number, (name, (centre, half)) in enumerate(BOXES.items()):
        places = (np.array(centre) + CORNERS * half).astype("<f4")
        triangles = [index for a, b, c, d in FACES for index in (a, b, c, a, c, d)]
        low, high = places.min(0).tolist(), places.max(0).tolist()
        positions = accessor(places, "VEC3", 5126, min=low, max=high)
        indices = accessor(np.array(triangles, "<u4"), "SCALAR", 5125)
        meshes.append({"primitives": [{"attributes": {"POSITION": positions}, "indices": indices, "material": number}]})
        nodes.append({"name": name, "mesh": number})
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{"name": name} for name in BOXES],
        "buffers": [{"byteLength": len(data), "uri": uri}],
        "bufferViews": views,
        "accessors": accessors,
    }


def write(folder: Path, duration: float, size: tuple[int, int], fov_deg: float, tables: bool) -> Path:
    """The scene, on the tables `orbit.csv` and `attitude.csv` or on a circular orbit, which the messages of a client replace."""
    (folder / "craft.gltf").write_text(json.dumps(_gltf()))
    orbit = 'file = "orbit.csv"\nframe = "GCRF"' if tables else "altitude = 400e3"
    attitude = 'mode = "file"\nfile = "attitude.csv"\nframe = "inertial"' if tables else 'mode = "nadir"'
    materials = "".join(
        f'[[material]]\nmatch = "{name}"\nabsorptivity = {alpha}\nemissivity = {epsilon}\nsides = "outside"\n'
        f'response = "transition"\nretarget = "merge"\nheating = {{ function = "quadratic", t_max = {t_max} }}\n'
        f'cooling = {{ function = "quadratic", t_max = {t_max} }}\n'
        for name, alpha, epsilon, t_max in [("body", 0.3, 0.8, 2000), ("wing", 0.75, 0.82, 400), ("boom", 0.85, 0.85, 100)]
    )
    path = folder / ("tables.toml" if tables else "craft.toml")
    path.write_text(f"""name = "craft"
[model]
path = "craft.gltf"
max_edge = 0.5
[time]
start = "{START}"
step = {STEP}
steps = {int(duration / STEP)}
draw_every = 20
[orbit]
{orbit}
[attitude]
{attitude}
[environment]
solar_constant = 1361
albedo = 0.3
planet_ir = 237
planet_radius = 6371e3
background_temperature = 2.7
eclipse = true
{materials}
[radiance]
band_um = [8, 14]
[camera]
width = {size[0]}
height = {size[1]}
fov_deg = {fov_deg}
frame = "body"
position = [0, -20, 0]
look_at = [0, 0, 0]
up = [0, 0, -1]
[output]
colour_range = [150, 400]
""")
    return path
