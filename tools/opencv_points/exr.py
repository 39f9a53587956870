"""Reads the EXR files that Isotherm writes: scan lines, ZIP, float32 and uint32 channels, without a library of Isotherm's side."""

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

DOUBLES = {"double": 1, "v2d": 2, "v3d": 3, "m33d": 9, "m44d": 16}


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\0", at)
    return data[at:end].decode("utf-8"), end + 1


def _value(kind: str, raw: bytes) -> Any:
    if kind in DOUBLES:
        values = np.frombuffer(raw, "<f8")
        return float(values[0]) if kind == "double" else values.reshape((3, 3) if kind == "m33d" else (4, 4)) if kind[0] == "m" else values
    if kind == "string":
        return raw.decode("utf-8")
    if kind == "int":
        return struct.unpack("<i", raw)[0]
    if kind == "stringvector":
        texts, at = [], 0
        while at < len(raw):
            (size,) = struct.unpack_from("<i", raw, at)
            texts.append(raw[at + 4 : at + 4 + size].decode("utf-8"))
            at += 4 + size
        return texts
    return raw


def read(path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """The channels and the attributes of a file."""
    data = path.read_bytes()
    assert data[:4] == b"\x76\x2f\x31\x01", f"{path} is no EXR file"
    header: dict[str, Any] = {}
    at = 8
    while data[at]:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        header[name] = _value(kind, data[at + 4 : at + 4 + size])
        at += 4 + size
    at += 1
    names, kinds, place = [], [], 0
    while header["channels"][place]:
        name, place = _text(header["channels"], place)
        names.append(name)
        kinds.append("<u4" if struct.unpack_from("<i", header["channels"], place)[0] == 0 else "<f4")
        place += 16
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    assert header["compression"] == b"\x03", "ZIP with 16 lines"
    channels = {name: np.zeros((height, width), kind) for name, kind in zip(names, kinds, strict=True)}
    blocks = -(-height // 16)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        line, size = struct.unpack_from("<ii", data, offset)
        rows = min(16, top + height - line)
        raw = data[offset + 8 : offset + 8 + size]
        if size < rows * width * 4 * len(names):
            # Predictor and split of even and odd bytes, as OpenEXR's ZIP has them.
            coded = np.frombuffer(zlib.decompress(raw), np.uint8).astype(np.int64)
            coded[1:] -= 128
            summed = (np.cumsum(coded) % 256).astype(np.uint8)
            plain = np.empty_like(summed)
            half = (len(summed) + 1) // 2
            plain[0::2], plain[1::2] = summed[:half], summed[half:]
            raw = plain.tobytes()
        place = 0
        for row in range(line - top, line - top + rows):
            for name in names:
                channels[name][row] = np.frombuffer(raw, channels[name].dtype, width, place)
                place += 4 * width
    return channels, header
