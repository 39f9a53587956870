"""Scenes of plates at one temperature before a camera with a stated calibration."""

import json
import math
import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 640, 512


@dataclass(frozen=True)
class Camera:
    """A calibration in OpenCV's numbers: the centre of the upper left pixel is (0, 0)."""

    name: str
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    skew: float = 0.0
    frame: str = "body"
    extra: dict[str, float] = field(default_factory=dict)

    @property
    def fisheye(self) -> bool:
        return len(self.distortion) == 4

    def toml(self) -> str:
        """The keys of `[camera]`. Isotherm's principal point is half a pixel further."""
        lines = [
            f"width = {WIDTH}",
            f"height = {HEIGHT}",
            f"fx = {self.fx!r}",
            f"fy = {self.fy!r}",
            f"cx = {self.cx + 0.5!r}",
            f"cy = {self.cy + 0.5!r}",
            "samples = 16",
            f'frame = "{self.frame}"',
            "near = 0.05",
        ]
        if self.distortion:
            model = "fisheye" if self.fisheye else "brown_conrady"
            lines += [f"distortion = {list(self.distortion)!r}", f'distortion_model = "{model}"']
        if self.skew:
            lines.append(f"skew = {self.skew!r}")
        lines += [f"{key} = {value!r}" for key, value in self.extra.items()]
        return "\n".join(lines) + "\n"


BARREL = (-0.31, 0.12, 0.0011, -0.0007, -0.021)
RATIONAL = (1.21, 0.43, -0.0004, 0.0006, 0.017, 1.57, 0.66, 0.09)
PRISM = (-0.2, 0.05, 0.001, 0.0005, 0.0, 0.0, 0.0, 0.0, 0.004, -0.001, -0.003, 0.002)
CUSHION = (0.18, 0.02, 0.0, 0.0, 0.0)
FISHEYE = (-0.013, 0.0042, -0.0019, 0.0002)

CAMERAS = [
    Camera("pinhole", 513.7, 509.2, 323.4, 250.8),
    Camera("pinhole with skew", 513.7, 509.2, 323.4, 250.8, skew=4.5),
    Camera("Brown-Conrady, 5 numbers", 513.7, 509.2, 323.4, 250.8, BARREL),
    Camera("pincushion, 5 numbers", 613.7, 609.2, 313.4, 260.8, CUSHION),
    Camera("Brown-Conrady, 8 numbers", 513.7, 509.2, 323.4, 250.8, RATIONAL),
    Camera("Brown-Conrady, 12 numbers", 513.7, 509.2, 323.4, 250.8, PRISM),
    Camera("12 numbers and skew, orbit frame", 513.7, 509.2, 323.4, 250.8, PRISM, skew=-3.0, frame="orbit"),
    Camera("fisheye", 420.0, 418.5, 318.2, 257.1, FISHEYE),
    Camera("wide fisheye, inertial frame", 350.0, 350.0, 319.5, 255.5, FISHEYE, frame="inertial"),
    Camera("fisheye with skew", 420.0, 418.5, 318.2, 257.1, FISHEYE, skew=2.0),
]

SCENE = """\
name = "plates"
[model]
path = "plates.glb"
[time]
step = 1.0
steps = 1
[orbit]
altitude = 772e3
phase_deg = 20
[attitude]
mode = "nadir"
nadir_axis = "+Z"
forward_axis = "+X"
[environment]
background_temperature = 2.7
[[material]]
match = "black"
absorptivity = 0.9
emissivity = 0.9
sides = "both"
back = { absorptivity = 0.9, emissivity = 0.9 }
response = "instant"
[initial]
temperature = 300
[camera]
position = [0.4, -0.3, 0.2]
quaternion = [0.93, 0.11, -0.21, 0.28]
"""

# The pose above as a rotation matrix (the norm of the quaternion is not 1) and a position.
POSITION = np.array([0.4, -0.3, 0.2])
_w, _x, _y, _z = np.array([0.93, 0.11, -0.21, 0.28]) / np.linalg.norm([0.93, 0.11, -0.21, 0.28])
FRAME_FROM_CAMERA = np.array(
    [
        [1 - 2 * (_y * _y + _z * _z), 2 * (_x * _y - _w * _z), 2 * (_x * _z + _w * _y)],
        [2 * (_x * _y + _w * _z), 1 - 2 * (_x * _x + _z * _z), 2 * (_y * _z - _w * _x)],
        [2 * (_x * _z - _w * _y), 2 * (_y * _z + _w * _x), 1 - 2 * (_x * _x + _y * _y)],
    ]
)


def plates(camera: Camera, frame_from_camera_axes: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Corners of the plates in the body frame, (plate, corner, axis): on rays spread over the frame, at several depths, tilted and turned. Their places
    need not be exact, because the comparison takes the corners that were made."""
    corners = []
    scale = 1.0 / camera.fx
    for number, (column, row) in enumerate((c, r) for r in (0.12, 0.37, 0.63, 0.88) for c in (0.1, 0.3, 0.5, 0.7, 0.9)):
        across = np.array([column * WIDTH - camera.cx, row * HEIGHT - camera.cy]) * scale
        if camera.fisheye:
            angle = np.linalg.norm(across)
            across = across * (math.tan(angle) / angle) if angle > 1e-9 else across
        ray = np.array([*across, 1.0])
        depth = 4.0 + 1.5 * (number % 4)
        centre = ray * depth
        half = 14.0 * scale * np.linalg.norm(centre)
        turn = 0.4 + 0.7 * number
        away = ray / np.linalg.norm(ray)
        right = np.cross([0.0, 1.0, 0.0], away)
        right /= np.linalg.norm(right)
        down = np.cross(away, right)
        tilt = 0.5 * math.sin(1.7 * number)
        first = math.cos(turn) * right + math.sin(turn) * down
        second = -math.sin(turn) * right + math.cos(turn) * down
        second = math.cos(tilt) * second + math.sin(tilt) * away
        square = [centre + half * (u * first + v * second) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        corners.append([frame_from_camera_axes @ corner + origin for corner in square])
    # The file holds single precision.
    return np.asarray(corners).astype(np.float32).astype(np.float64)


def write_model(path: Path, corners: np.ndarray) -> None:
    """A glTF file with one node for each plate."""
    positions = corners.astype("<f4").tobytes()
    indices = np.array([0, 1, 2, 0, 2, 3], "<u2").tobytes()
    count = len(corners)
    low, high = corners.min(axis=1), corners.max(axis=1)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(count))}],
        "nodes": [{"mesh": number, "name": f"plate_{number}"} for number in range(count)],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": number + 1}, "indices": 0, "material": 0}]} for number in range(count)
        ],
        "materials": [{"name": "black"}],
        "buffers": [{"byteLength": len(indices) + len(positions)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(indices)},
            {"buffer": 0, "byteOffset": len(indices), "byteLength": len(positions)},
        ],
        "accessors": [{"bufferView": 0, "componentType": 5123, "count": 6, "type": "SCALAR"}]
        + [
            {
                "bufferView": 1,
                "byteOffset": 48 * number,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "min": low[number].tolist(),
                "max": high[number].tolist(),
            }
            for number in range(count)
        ],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary = indices + positions
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
