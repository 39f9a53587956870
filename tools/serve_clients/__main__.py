"""Runs the scenario against the server and compares what came with Basilisk's own messages and with `isotherm render`.

python -m serve_clients ISOTHERM FOLDER [--images N]
"""

import argparse
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
from opencv_points.exr import read
from PIL import Image

from . import craft
from .basilisk import CAMERA_POSITION, FOV_DEG, INTERVAL, SIZE
from .robotics import check_log
from .rotations import quaternion, rotation

MOST_SECONDS = 900


def pose(line: dict) -> tuple[np.ndarray, np.ndarray]:
    """Rotation from the target's body axes to the camera's (OpenCV), and the camera's place in the body frame [m], from Basilisk's messages."""
    target, chaser = (rotation(line[name]["sigma"]) for name in ("target", "chaser"))
    place = target @ (np.array(line["chaser"]["r"]) + chaser.T @ CAMERA_POSITION - np.array(line["target"]["r"]))
    return rotation(line["sigma_CB"]) @ chaser @ target.T, place


class Server:
    """`isotherm serve` as long as the block lasts."""

    def __init__(self, isotherm: str, folder: Path) -> None:
        arguments = [isotherm, "serve", "craft.toml", "--protocol", "vizard", "--listen", "127.0.0.1:0"]
        arguments += ["--picture", "surface16", "--log", "requests.log"]
        self.process = subprocess.Popen(arguments, cwd=folder, stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        assert line.startswith("listening on "), line
        self.port = int(line.rsplit(":", 1)[1])

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        assert self.process.wait(60) == 0, "the server ends in order"


def run_scenario(port: int, folder: Path, images: int, mode: str = "no-display") -> list[dict]:
    folder.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "serve_clients.basilisk", str(port), str(folder), str(images), mode]
    subprocess.run(command, check=True, timeout=MOST_SECONDS, stdout=subprocess.DEVNULL)
    lines = [json.loads(line) for line in (folder / "states.jsonl").read_text().splitlines()]
    assert len(lines) == images and all(line["valid"] for line in lines), "every image came"
    return lines


def render(isotherm: str, folder: Path, lines: list[dict]) -> None:
    """`isotherm render` along the same states: tables of orbit and attitude, and of the camera in the body frame."""
    first = lines[0]
    rows, turns, poses = ["time,x,y,z,vx,vy,vz"], ["time,qw,qx,qy,qz"], ["time,x,y,z,qw,qx,qy,qz"]

    def row(time: float, *numbers: float) -> str:
        return ",".join(repr(float(number)) for number in (time, *numbers))

    # Time 0, of which Basilisk sends nothing: backwards on the circle by one interval.
    r, v = np.array(first["target"]["r"]), np.array(first["target"]["v"])
    angle = -np.linalg.norm(v) / np.linalg.norm(r) * first["time"]
    normal = np.cross(r, v) / np.linalg.norm(np.cross(r, v))

    def turned(vector: np.ndarray) -> np.ndarray:
        return vector * np.cos(angle) + np.cross(normal, vector) * np.sin(angle)

    rows.append(row(0.0, *turned(r), *turned(v)))
    body = rotation(first["target"]["sigma"]).T
    turns.append(row(0.0, *quaternion(np.array([turned(column) for column in body.T]).T)))
    for line in lines:
        rows.append(row(line["time"], *line["target"]["r"], *line["target"]["v"]))
        turns.append(row(line["time"], *quaternion(rotation(line["target"]["sigma"]).T)))
        camera, place = pose(line)
        poses.append(row(line["time"], *place, *quaternion(camera.T)))
    for name, table in (("orbit.csv", rows), ("attitude.csv", turns), ("poses.csv", poses)):
        (folder / name).write_text("\n".join(table) + "\n")
    craft.write(folder, lines[-1]["time"], SIZE, FOV_DEG, tables=True)
    # The program states the horizontal field of view of a scene; the vertical one is the camera's.
    focal = SIZE[1] / 2 / np.tan(np.radians(FOV_DEG) / 2)
    scene = (folder / "tables.toml").read_text()
    lens = f"fx = {float(focal)!r}\nfy = {float(focal)!r}\ncx = {SIZE[0] / 2}\ncy = {SIZE[1] / 2}"
    (folder / "tables.toml").write_text(scene.replace(f"fov_deg = {FOV_DEG}", lens))
    command = [isotherm, "render", "tables.toml", "--poses", "poses.csv", "-o", "rendered", "--force"]
    subprocess.run(command, cwd=folder, check=True, timeout=MOST_SECONDS)


def compare(folder: Path, pictures: Path, lines: list[dict]) -> dict[str, float]:
    """The largest differences over all images."""
    worst = {"kelvin": 0.0, "edge pixels": 0.0, "key point px": 0.0, "kelvin of the last image on the first": 0.0}
    files = sorted((folder / "rendered").rglob("*.exr"))
    assert len(files) == len(lines), f"{len(files)} images for {len(lines)} poses"
    focal = SIZE[1] / 2 / np.tan(np.radians(FOV_DEG) / 2)
    coldest, hottest = 1e9, 0.0
    kelvin_of = lambda number: np.asarray(Image.open(pictures / f"{number:03}.png"), np.uint16) * 0.01  # noqa: E731
    for number, (line, file) in enumerate(zip(lines, files, strict=True), 1):
        kelvin = kelvin_of(number)
        channels, header = read(file)
        assert abs(header["isotherm_time_s"] - line["time"]) < 1e-6
        here, there = kelvin > 0, channels["part"] != 0
        both = here & there
        worst["edge pixels"] = max(worst["edge pixels"], float((here != there).sum()))
        worst["kelvin"] = max(worst["kelvin"], float(np.abs(kelvin - channels["T"])[both].max()))
        if number == 1:
            other = kelvin_of(len(lines))
            more = np.abs(other - channels["T"])[both & (other > 0)].max()
            worst["kelvin of the last image on the first"] = max(worst["kelvin of the last image on the first"], float(more))
        coldest, hottest = min(coldest, float(kelvin[here].min())), max(hottest, float(kelvin[here].max()))
        # The outermost key points bound the craft in the picture.
        camera, place = pose(line)
        points = np.array([camera @ (point - place) for point in craft.key_points().values()])
        u, v = SIZE[0] / 2 + focal * points[:, 0] / points[:, 2], SIZE[1] / 2 + focal * points[:, 1] / points[:, 2]
        columns, rows = np.where(here.any(0))[0], np.where(here.any(1))[0]
        for low, high, lit in ((u.min(), u.max(), columns), (v.min(), v.max(), rows)):
            # A pixel is lit where its centre is covered, so the edge lies within half a pixel of the last lit one's border.
            worst["key point px"] = max(worst["key point px"], abs(lit[0] - low), abs(lit[-1] + 1 - high))
    worst["warming"] = hottest - coldest
    return worst


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("isotherm")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--images", type=int, default=100)
    arguments = parser.parse_args()
    isotherm, folder = os.path.abspath(arguments.isotherm), arguments.folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    craft.write(folder, 1000.0, SIZE, FOV_DEG, tables=False)
    failures = []

    def expect(good: bool, sentence: str) -> None:
        print(("ok: " if good else "FAILED: ") + sentence, flush=True)
        if not good:
            failures.append(sentence)

    with Server(isotherm, folder) as server:
        lines = run_scenario(server.port, folder / "first", arguments.images)
        render(isotherm, folder, lines)
        worst = compare(folder, folder / "first", lines)
        told = ", ".join(f"{name} {value:.4g}" for name, value in worst.items())
        expect(worst["kelvin"] < 0.05, f"temperatures are those of isotherm render: {told}")
        expect(worst["edge pixels"] <= 4, "the outlines are the same")
        expect(worst["key point px"] <= 0.5, "key points from Basilisk's own messages bound the craft within half a pixel")
        expect(worst["kelvin of the last image on the first"] > 0.05, "an image of another time does not pass")
        run_scenario(server.port, folder / "second", 5)
        same = all((folder / "first" / name).read_bytes() == (folder / "second" / name).read_bytes() for name in ("001.png", "005.png"))
        expect(same, "a second scenario on the same server has the same images")
        run_scenario(server.port, folder / "live", 3, "live")
        difference = np.abs(
            np.asarray(Image.open(folder / "first" / "003.png"), float) - np.asarray(Image.open(folder / "live" / "003.png"), float)
        )
        expect(bool(np.median(difference) <= 1 and (difference > 5).sum() <= 4), "live mode has the same images")
    expect("REQUEST_IMAGE_1" in (folder / "requests.log").read_text(), "the log has the requests")

    # A server that dies: Basilisk waits for ever, which its parent must end.
    (folder / "killed").mkdir(exist_ok=True)
    server = Server(isotherm, folder)
    command = [sys.executable, "-m", "serve_clients.basilisk", str(server.port), str(folder / "killed"), "1000"]
    client = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        while client.poll() is None and not (folder / "killed" / "states.jsonl").exists():
            try:
                client.wait(0.2)
            except subprocess.TimeoutExpired:
                pass
        server.process.send_signal(signal.SIGKILL)
        server.process.wait()
        try:
            client.wait(5)
            waits = False
        except subprocess.TimeoutExpired:
            waits = True
        expect(waits, "Basilisk waits for a server that was killed, as docs/serve.md says")
    finally:
        client.kill()
    expect(*check_log(isotherm, folder))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
