"""Scenes of a black or grey plate, or of narrow strips, at one temperature, as glTF and TOML."""

import base64
import json
import struct
import subprocess


def plate(half):
    """Corners of a square plate in the plane z = 0."""
    return [(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)]


def quads(path, corners):
    """Quads with two faces, from the corners of one after another."""
    places, indices = 12 * len(corners), [at + corner for at in range(0, len(corners), 4) for corner in (0, 1, 2, 0, 2, 3)]
    data = b"".join(struct.pack("<3f", *corner) for corner in corners) + struct.pack(f"<{len(indices)}H", *indices)
    low, high = [min(c[i] for c in corners) for i in range(3)], [max(c[i] for c in corners) for i in range(3)]
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    floats = {"bufferView": 0, "componentType": 5126, "count": len(corners), "type": "VEC3", "min": low, "max": high}
    model = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "plate", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": "paint", "doubleSided": True}],
        "buffers": [{"byteLength": len(data), "uri": uri}],
        "bufferViews": [{"buffer": 0, "byteLength": places}, {"buffer": 0, "byteOffset": places, "byteLength": len(data) - places}],
        "accessors": [floats, {"bufferView": 1, "componentType": 5123, "count": len(indices), "type": "SCALAR"}],
    }
    path.write_text(json.dumps(model))


SCENE = """
[model]
path = "plate.gltf"
[time]
step = {step}
steps = {steps}
[orbit]
altitude = 408e3
[attitude]
mode = "nadir"
[environment]
background_temperature = {temperature}
[[material]]
match = "*"
absorptivity = 0.5
emissivity = {emissivity}
sides = "both"
back = {{ absorptivity = 0.5, emissivity = {emissivity} }}
response = "instant"
[camera]
{camera}
position = [0, 0, -5]
look_at = [0, 0, 0]
up = {up}
{joint}
{more}
[sensor]
{sensor}
[output]
files = ["dn.png", "mask.png"{kelvin}]
"""

SMALL = "width = 160\nheight = 128\nfov_deg = 20"


def run(program, folder, name, sensor, device, half=5.0, corners=None, **changes):
    """Runs a plate, or other quads, and returns the folder of its files."""
    place = folder / name
    place.mkdir(parents=True)
    quads(place / "plate.gltf", corners or plate(half))
    values = {"step": 1, "steps": 1, "temperature": 300, "emissivity": 1, "camera": SMALL, "up": "[0, 1, 0]", "joint": "", "more": ""}
    kelvin = ', "kelvin.png"' if "kelvin_per_count" in sensor else ""
    if ramp := changes.pop("ramp", None):
        seconds = values["steps"] if "steps" not in changes else changes["steps"] * changes["step"] + 1
        rows = "".join(f"{time},{300 + ramp * time}\n" for time in (0, seconds))
        (place / "ramp.csv").write_text("time,plate\n" + rows)
        changes["more"] = '[temperatures]\nfile = "ramp.csv"\n'
    (place / "scene.toml").write_text(SCENE.format(**(values | changes), sensor=sensor, kelvin=kelvin))
    command = [str(program), "run", str(place / "scene.toml"), "-o", str(place / "out")]
    done = subprocess.run(command + device, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{name}: {done.stderr}")
    return place / "out"
