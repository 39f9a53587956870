"""tools/newcomer: see there. python -m first_hour ISOTHERM -o DIR"""

import argparse
import csv
import os
import re
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from opencv_points.exr import read

from . import craft
from .pages import blocks, shell

# The materials of the model in place of those of the page's example, and the edge of a craft of three metres.
OWN = {"hbltel_2": "MLI_GOLD", "hbltel_3": "CELLS", "max_edge = 1.0": "max_edge = 0.2"}
USES = {"PAINT_WHITE": "body", "MLI_GOLD": "foil", "CELLS": "array"}
# A calibration as cv2.calibrateCamera returns it: the centre of the upper left pixel is (0, 0).
SIZE, FX, FY, CX, CY = (320, 240), 510.3, 509.1, 161.7, 117.2
DISTORTION = [-0.31, 0.12, 0.0011, -0.0008, -0.02]


class Hour:
    """The steps, each with its time, and what was found wrong."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.failures, self.hand = folder, 0, None

    def expect(self, good: bool, sentence: str) -> None:
        print(("  ok: " if good else "  FAILED: ") + sentence, flush=True)
        self.failures += not good

    def step(self, name: str, do: Callable[["Hour"], None]) -> None:
        print(name, flush=True)
        begin = time.monotonic()
        do(self)
        print(f"  {time.monotonic() - begin:.1f} s", flush=True)


def plausible(hour: Hour, kelvin: np.ndarray, what: str) -> None:
    """Every temperature lies within the bounds of the hand calculation."""
    low, high = hour.hand.bounds()
    inside = lambda values: bool(low < values.min() and values.max() < high)  # noqa: E731
    told = f"{kelvin.min():.0f} to {kelvin.max():.0f} K within {low:.0f} to {high:.0f} K by hand"
    hour.expect(inside(kelvin) and not inside(np.append(kelvin, 2.7)), f"{what}: {told}")


def seen(path: Path) -> np.ndarray:
    channels, _ = read(path)
    return channels["T"][channels["part"] != 0]


def tutorial(hour: Hour) -> None:
    """All blocks of docs/tutorial.md, with the materials of the own model."""
    craft.write(hour.folder / "craft.glb")
    printed = {}
    for kind, text in blocks("tutorial.md"):
        for word, own in OWN.items():
            text = text.replace(word, own)
        if kind == "toml":
            first = text.splitlines()[0].removeprefix("# ")
            with (hour.folder / first.split(": ")[1]).open("a" if first.startswith("Add") else "w") as file:
                file.write(text)
        elif kind == "sh":
            begin = time.monotonic()
            printed[text] = shell(text, hour.folder)
            print(f"  {time.monotonic() - begin:5.1f} s  {'; '.join(text.splitlines())}", flush=True)
    page = (Path(__file__).parents[2] / "docs/tutorial.md").read_text()
    promised = [line.split("`")[1] for line in page.splitlines() if line.startswith("| `")]
    left = [name for name in [*promised, "first/contact_sheet.png", "noon.exr"] if not (hour.folder / name).stat().st_size]
    hour.expect(len(promised) == 6 and not left, f"all {len(promised)} files of the page's table are there")
    told = "\n".join(printed.values())
    hour.expect("-1.500 to 1.500 m" in told, "isotherm info tells the size in metres")
    hour.expect("without a contact" not in told, "no neighbours are left without a contact")
    surfaces = tomllib.loads((hour.folder / "surfaces.toml").read_text())
    scene = tomllib.loads((hour.folder / "craft.toml").read_text())
    hour.hand = craft.HandCalculation({name: surfaces[use] for name, use in USES.items()}, scene["orbit"], scene["environment"])
    plausible(hour, np.concatenate([seen(path) for path in sorted((hour.folder / "out/frames").glob("*.exr"))]), "network image")
    with (hour.folder / "out/series.csv").open() as file:
        rows = list(csv.DictReader(file))
    mean = np.mean([float(row["all:mean"]) for row in rows])
    by_hand, other = hour.hand.mean(), hour.hand.mean(absorbs=1.5)
    hour.expect(abs(mean - by_hand) < 12, f"mean of the orbit {mean:.1f} K, by hand as one node {by_hand:.1f} K")
    hour.expect(abs(mean - other) > 12, f"half as much sunlight again would be {other:.1f} K")


def approach(hour: Hour) -> None:
    """A chaser with a calibrated camera comes closer by a metre a second."""
    scene = (hour.folder / "craft.toml").read_text()
    scene = scene.replace("steps = 96 ", "steps = 1 ").replace("draw_every = 24 ", "images = { start = 0, stop = 24, rate_hz = 0.25 } ")
    (hour.folder / "approach.csv").write_text("time,x,y,z\n" + "".join(f"{t},-3,{-32 + t},4\n" for t in range(0, 25, 4)))
    # The pages say that OpenCV's principal point is half a pixel from isotherm's.
    camera = f"width = {SIZE[0]}\nheight = {SIZE[1]}\nfx = {FX}\nfy = {FY}\ncx = {CX + 0.5}\ncy = {CY + 0.5}\ndistortion = {DISTORTION}\n"
    scene += f'\n[camera]\n{camera}path = "approach.csv"\nlook_at = [2, 0, 0.3]\n\n[sensor]\nnetd = 0.05\nrange = [150, 420]\nbits = 14\n'
    (hour.folder / "approach.toml").write_text(scene)
    shell("isotherm run craft.toml -o warm --save-state warm.state --save-state-at 0", hour.folder)
    shell("isotherm check approach.toml; isotherm run approach.toml -o approach --from-state warm.state", hour.folder)
    frames = sorted((hour.folder / "approach").rglob("*.exr"))
    hour.expect(len(frames) == 7, f"{len(frames)} images of the approach")
    worst, without, kelvin = 0.0, 0.0, []
    for frame in frames:
        channels, header = read(frame)
        shown = channels["part"] != 0
        kelvin.append(channels["T"][shown])
        rows, columns = np.where(shown)
        # The box of the craft's pixels against the projection of its corners, with the formulas of OpenCV's projectPoints.
        t = header["isotherm_time_s"]
        place = np.array([-3.0, -32.0 + t, 4.0])
        forward = (np.array([2, 0, 0.3]) - place) / np.linalg.norm(np.array([2, 0, 0.3]) - place)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        turn = np.array([right, np.cross(forward, right), forward])
        for distortion in (DISTORTION, [0.0] * 5):
            pixels = project((craft.corners() - place) @ turn.T, distortion)
            box = np.array([columns.min(), rows.min(), columns.max(), rows.max()])
            # The middle of the box: at both ends a sharp corner may meet no sample.
            off = np.abs(0.5 * (pixels.min(0) + pixels.max(0)) - 0.5 * (box[:2] + box[2:])).max()
            worst, without = (max(worst, off), without) if any(distortion) else (worst, max(without, off))
    # Half a pixel of rounding, and half a pixel of the finer image that a lens resamples.
    hour.expect(worst < 1.0, f"the middle of the craft's box is where OpenCV's formulas put its corners, within {worst:.2f} px")
    hour.expect(without > 1.0, f"without distortion it would be {without:.2f} px off")
    plausible(hour, np.concatenate(kelvin), "approach")


def project(points: np.ndarray, distortion: list[float]) -> np.ndarray:
    """Pixels of points in camera axes, by the formulas of OpenCV's projectPoints."""
    k1, k2, p1, p2, k3 = distortion
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([FX * u + CX, FY * v + CY], 1)


def python_loop(hour: Hour) -> None:
    """The ten lines of docs/python.md, with the own scene."""
    (text,) = [text for kind, text in blocks("python.md") if kind == "python" and "for second in range" in text]
    loop = hour.folder / "loop.py"
    loop.write_text(text.replace("models/cubesat.toml", "craft.toml"))
    done = subprocess.run([sys.executable, "loop.py"], cwd=hour.folder, capture_output=True, text=True)
    numbers = np.array([[float(word) for word in line.split()] for line in done.stdout.splitlines()])
    hour.expect(done.returncode == 0 and numbers.shape == (5, 2), f"the loop has five images {done.stderr[-300:]}")
    if numbers.shape == (5, 2):
        plausible(hour, numbers[:, 0], "the loop's means")
        hour.expect(bool((np.diff(numbers[:, 1]) < 0).all()), f"the camera comes closer: {numbers[:, 1].round(2).tolist()} m")


def page(hour: Hour) -> None:
    """`isotherm view` in a browser on a desk and on a phone. `tools/view_check` waits for each image, however long it takes."""
    tool, pictures = Path(__file__).parents[1] / "view_check", hour.folder / "page"
    command = [tool, "--look", hour.folder / "craft.toml", pictures, "--from-state", hour.folder / "warm.state"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == 3:
        print(f"  left out: {done.stderr.splitlines()[-1]}")
        return
    told = re.search(r"([\d.]+) K (\w+) (\w+), emissivity", done.stdout)
    hour.expect(done.returncode == 0 and told is not None, f"the page shows the craft in the middle of its image {done.stderr[-300:]}")
    if told:
        plausible(hour, np.array([float(told[1])]), f"{told[2]} of {told[3]} on the page")
    hour.expect(len(list(pictures.glob("page_*.png"))) == 2, "there are pictures of a desk and of a phone")


def data_set(hour: Hour) -> None:
    """A small data set of the approach's scene, made and verified."""
    spec = 'scene = "approach.toml"\nsamples = 6\nposes_per_orbit = 3\nseed = 1\nimages = ["numbers", "radiance"]\n'
    spec += '[each_orbit.orbit]\nbeta_deg = { uniform = [-40, -20] }\n[camera]\nkind = "shell"\ndistance = { uniform = [6, 20] }\n'
    (hour.folder / "set.toml").write_text(spec)
    shell("isotherm dataset set.toml -o set; isotherm dataset verify set --samples 1; cd set; sha256sum --quiet -c checksums.sha256", hour.folder)
    frames = sorted((hour.folder / "set").rglob("radiance/*.exr"))
    hour.expect(len(frames) == 6, f"{len(frames)} labelled images")
    plausible(hour, np.concatenate([seen(path) for path in frames]), "data set")


def main() -> int:
    parser = argparse.ArgumentParser(prog="tools/newcomer")
    parser.add_argument("isotherm", type=Path)
    parser.add_argument("-o", dest="folder", type=Path, required=True)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True)
    os.environ["ISOTHERM"] = str(arguments.isotherm.resolve())
    os.environ["PATH"] = f"{arguments.isotherm.resolve().parent}:{os.environ['PATH']}"
    hour = Hour(arguments.folder.resolve())
    begin = time.monotonic()
    hour.step("1. own glTF to a network image: docs/tutorial.md", tutorial)
    hour.step("2. calibrated approach: docs/tutorial.md 7, docs/scene.md", approach)
    hour.step("3. loop in Python: docs/python.md", python_loop)
    hour.step("4. page in a browser: docs/view.md", page)
    hour.step("5. data set: docs/datasets.md", data_set)
    print(f"all: {time.monotonic() - begin:.1f} s; pictures are in {hour.folder}")
    return 1 if hour.failures else 0


if __name__ == "__main__":
    sys.exit(main())
