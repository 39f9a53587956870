"""The scenes whose images are compared, as files that Isotherm reads; Mitsuba is given what Isotherm made of them.

Every node is at the balance of time 0, so that a flat face has one temperature and a round one few.
"""

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

from peer_bench.workshop import ROOT, Unavailable

WIDTH, HEIGHT = 640, 512

CUBE = """\
name = "cube"

[model]
path = "cube.glb"

[time]
step = 1.0
steps = 1

[orbit]
altitude = 772e3
phase_deg = 20

[attitude]
mode = "nadir"

[environment]
solar_constant = 1361
planet_ir = 237
background_temperature = 2.7

[[material]]
match = "aluminium"
absorptivity = 0.18
emissivity = 0.21
response = "instant"

[camera]
width = 640
height = 512
fov_deg = 30
samples = 1
position = [2.1, 1.3, -1.9]
look_at = [0, 0, 0]
up = [0, 0, -1]
"""


def station(edge: float | None) -> Callable[[Path], str]:
    """models/station_transition.toml at its start without memory and joints, its triangles as in the file or up to an edge [m]."""

    def write(_: Path) -> str:
        kept, skip = [], False
        for line in (ROOT / "models" / "station_transition.toml").read_text(encoding="utf-8").splitlines():
            if line.startswith("["):
                skip = line in ("[[joint]]", "[[probe]]")
            if not skip:
                kept.append(line)
        text = "\n".join(kept) + "\n"
        for old, new in (
            ('path = "station.glb"', f'path = "{ROOT / "models" / "station.glb"}"'),
            ("max_edge = 1.0\n", "" if edge is None else f"max_edge = {edge}\n"),
            ('response = "transition"', 'response = "instant"'),
            ("width = 1024", f"width = {WIDTH}"),
            ("height = 768", f"height = {HEIGHT}"),
        ):
            if old not in text:
                raise Unavailable(f"models/station_transition.toml no longer has `{old.strip()}`")
            text = text.replace(old, new)
        return text

    return write


def cube(folder: Path) -> str:
    """A cube of 1 m in the paper's aluminium."""
    positions: list[np.ndarray] = []
    normals: list[np.ndarray] = []
    indices: list[int] = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, u = np.eye(3)[axis] * sign, np.eye(3)[(axis + 1) % 3]
            v = np.cross(normal, u)
            first = len(positions)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                positions.append(0.5 * (normal + a * u + b * v))
                normals.append(normal)
            indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    (folder / "cube.glb").write_bytes(glb(np.array(positions), np.array(normals), np.array(indices)))
    return CUBE


def glb(positions: np.ndarray, normals: np.ndarray, indices: np.ndarray) -> bytes:
    """A binary glTF file of one mesh."""
    parts = [positions.astype("<f4").tobytes(), normals.astype("<f4").tobytes(), indices.astype("<u4").tobytes()]
    starts = np.cumsum([0, *(len(part) for part in parts)]).tolist()
    count = len(positions)
    corners = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
    described = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "cube"}],
        "materials": [{"name": "aluminium"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3", **corners},
            {"bufferView": 1, "componentType": 5126, "count": count, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5125, "count": len(indices), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    text = json.dumps(described).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(parts)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


SCENES: dict[str, Callable[[Path], str]] = {
    "cube": cube,
    "station, triangles of its file": station(None),
    "station, edges up to 1 m": station(1.0),
}
