"""Writes small binary glTF files and reads the parts of one. Needs numpy alone."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass
class Part:
    """Triangles (n, 3, 3) [m] of one part and material, in the frame of the body."""

    name: str
    material: str
    triangles: np.ndarray
    # Unit normals (n, 3, 3) of the file where it has them; flat ones otherwise.
    normals: np.ndarray | None = None


def flat_normals(triangles: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of triangles; zero where a triangle has no area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    return np.divide(across, length, out=np.zeros_like(across), where=length > 0)


def write(path: Path, parts: list[Part]) -> None:
    """A node for each name, with a primitive for each of its materials."""
    binary = bytearray()
    document: dict = {"asset": {"version": "2.0"}, "scene": 0, "bufferViews": [], "accessors": [], "materials": [], "meshes": [], "nodes": []}
    names = list(dict.fromkeys(part.name for part in parts))
    materials = list(dict.fromkeys(part.material for part in parts))
    document["materials"] = [{"name": name} for name in materials]

    def accessor(values: np.ndarray, kind: str, component: int) -> int:
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes})
        binary.extend(values.tobytes() + b"\0" * (-values.nbytes % 4))
        entry = {"bufferView": len(document["bufferViews"]) - 1, "componentType": component, "count": len(values), "type": kind}
        if kind == "VEC3":
            entry |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        document["accessors"].append(entry)
        return len(document["accessors"]) - 1

    for name in names:
        primitives = []
        for part in (part for part in parts if part.name == name):
            normals = part.normals if part.normals is not None else np.repeat(flat_normals(part.triangles)[:, None], 3, 1)
            both = np.concatenate([part.triangles.reshape(-1, 3), normals.reshape(-1, 3)], 1).astype("<f4")
            corners, index = np.unique(both, axis=0, return_inverse=True)
            attributes = {"POSITION": accessor(np.ascontiguousarray(corners[:, :3]), "VEC3", 5126), "NORMAL": accessor(np.ascontiguousarray(corners[:, 3:]), "VEC3", 5126)}
            indices = accessor(index.ravel().astype("<u4"), "SCALAR", 5125)
            primitives.append({"attributes": attributes, "indices": indices, "material": materials.index(part.material)})
        document["meshes"].append({"primitives": primitives})
        document["nodes"].append({"name": name, "mesh": len(document["meshes"]) - 1})
    document["scenes"] = [{"nodes": list(range(len(names)))}]
    document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary))
    path.write_bytes(head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + bytes(binary))


def _turned(quaternion: list[float]) -> np.ndarray:
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _local(node: dict) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    local = np.eye(4)
    local[:3, :3] = _turned(node.get("rotation", [0, 0, 0, 1])) * np.array(node.get("scale", [1, 1, 1]), float)
    local[:3, 3] = node.get("translation", [0, 0, 0])
    return local


def read(path: Path, turned=None) -> list[Part]:
    """All parts of a binary glTF in its own pose. `turned` gives a further rotation (3, 3) of a node's own frame, by its name."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + size])
    binary = data[20 + size + 8 :]

    def values(index: int) -> np.ndarray:
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        kind, width, count = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]], accessor["count"]
        at = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * width)
        rows = np.ndarray((count, width), kind, binary, at, (stride, kind.itemsize))
        return rows[:, 0].copy() if width == 1 else rows.astype(float)

    parts = []

    def visit(index: int, above: np.ndarray) -> None:
        node = document["nodes"][index]
        place = above @ _local(node)
        if turned is not None and (turn := turned(node.get("name", ""))) is not None:
            further = np.eye(4)
            further[:3, :3] = turn
            place = place @ further
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            positions = values(primitive["attributes"]["POSITION"]) @ place[:3, :3].T + place[:3, 3]
            index_of = values(primitive["indices"]) if "indices" in primitive else np.arange(len(positions))
            normals = None
            if "NORMAL" in primitive["attributes"]:
                normals = values(primitive["attributes"]["NORMAL"]) @ np.linalg.inv(place[:3, :3])
                normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
                normals = normals[index_of].reshape(-1, 3, 3)
            material = document["materials"][primitive["material"]]["name"]
            parts.append(Part(node.get("name", ""), material, positions[index_of].reshape(-1, 3, 3), normals))
        for child in node.get("children", []):
            visit(child, place)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, np.eye(4))
    return parts
