"""Measures the ten-line loop: images a second beside the command line's, and memory over many images.

    python python/tests/measure.py [--images 10000] [--size 64x48] [--no-program]

Beside the rate stands the processor time of an image, which does not depend on what else the machine does.

Two others draw the same poses. The loop in Rust (``tools/src/images.rs``) writes no files either. ``isotherm render --poses`` writes an EXR file for each
image; what it takes for one image is subtracted. Both are those of target/release, or of the folder that ISOTHERM_PROGRAMS names:

    cargo build --release --workspace --bin isotherm --bin images
"""

from __future__ import annotations

import argparse
import math
import os
import resource
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import isotherm

REPOSITORY = Path(__file__).resolve().parents[2]


def resident() -> float:
    """Memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def places(count: int) -> Iterator[tuple[float, float, float]]:
    """A circle round the craft [m]."""
    for number in range(count):
        angle = 2 * math.pi * number / 500
        yield 2.5 * math.cos(angle), 2.5 * math.sin(angle), -1.5


def of_python(scene: Path, count: int) -> tuple[float, float]:
    """Images a second, and the processor time of an image [ms]. Prints the memory along the way."""
    simulation = isotherm.Simulation(scene)
    for position in places(50):
        simulation.image(position=position, look_at=(0, 0, 0), up=(0, 0, -1))
    first = resident()
    most = first
    began, worked = time.perf_counter(), time.process_time()
    for number, position in enumerate(places(count)):
        frame = simulation.image(position=position, look_at=(0, 0, 0), up=(0, 0, -1))
        if number % 100 == 99:
            most = max(most, resident())
    took, work = time.perf_counter() - began, 1e3 * (time.process_time() - worked) / count
    assert (frame.part > 0).any()
    print(f"python: {count} images, {count / took:.1f} images/s, {work:.3f} ms of processor time each")
    print(f"memory: {first:.1f} MB before, at most {most:.1f} MB, {resident():.1f} MB after {count} images")
    return count / took, work


def quaternion(position: tuple[float, float, float]) -> list[float]:
    """Camera axes in the body frame for a look at the origin with -Z up, scalar-first."""
    length = math.sqrt(sum(value * value for value in position))
    forward = [-value / length for value in position]
    right = [-forward[1], forward[0], 0.0]
    size = math.hypot(*right)
    right = [value / size for value in right]
    down = [forward[(i + 1) % 3] * right[(i + 2) % 3] - forward[(i + 2) % 3] * right[(i + 1) % 3] for i in range(3)]
    x, y, z = right, down, forward
    # The columns of the rotation are x, y and z.
    numbers = [1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2], 1 - x[0] + y[1] - z[2], 1 - x[0] - y[1] + z[2]]
    sizes = [math.sqrt(max(number, 0.0)) / 2 for number in numbers]
    best = sizes.index(max(sizes))
    pairs = {
        (0, 1): y[2] - z[1], (0, 2): z[0] - x[2], (0, 3): x[1] - y[0],
        (1, 2): x[1] + y[0], (1, 3): z[0] + x[2], (2, 3): y[2] + z[1],
    }  # fmt: skip
    other = {i: pairs[min(i, best), max(i, best)] / (4 * sizes[best]) for i in range(4) if i != best}
    return [sizes[best] if i == best else other[i] for i in range(4)]


def programs() -> Path:
    """The folder of the programs."""
    return Path(os.environ.get("ISOTHERM_PROGRAMS", REPOSITORY / "target/release"))


def of_children() -> float:
    """Processor time of the programs so far [ms]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 1e3 * (used.ru_utime + used.ru_stime)


def of_rust(scene: Path, count: int) -> tuple[float, float]:
    """Images a second of the same loop in Rust, and the processor time of an image [ms]."""
    work = []
    for images in (1, count):
        before = of_children()
        command = [programs() / "images", scene, "--images", str(images)]
        rate = float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        work.append(of_children() - before)
    each = (work[1] - work[0]) / (count - 1)
    print(f"rust: {count} images, {rate:.1f} images/s, {each:.3f} ms of processor time each")
    return rate, each


def of_the_program(scene: Path, count: int) -> float:
    """Images a second of ``isotherm render --poses``."""
    path = programs() / "isotherm"

    def took(poses: int) -> float:
        rows = [f"0,{','.join(map(repr, [*position, *quaternion(position)]))}" for position in places(poses)]
        table = scene.with_name("poses.csv")
        table.write_text("\n".join(["time,x,y,z,qw,qx,qy,qz", *rows]) + "\n")
        with tempfile.TemporaryDirectory(dir=scene.parent) as out:
            began = time.perf_counter()
            subprocess.run([path, "render", scene, "--poses", table, "-o", out], check=True, capture_output=True)
            return time.perf_counter() - began

    rate = (count - 1) / (took(count) - took(1))
    print(f"isotherm render --poses: {count} images, {rate:.1f} images/s with their files")
    return rate


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure images a second and memory.")
    parser.add_argument("--images", type=int, default=10000)
    parser.add_argument("--size", default="64x48")
    parser.add_argument("--no-program", action="store_true")
    arguments = parser.parse_args()
    width, height = arguments.size.split("x")
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "cubesat.toml"
        for name in ("cubesat.glb", "materials.toml"):
            (Path(folder) / name).write_bytes((REPOSITORY / "models" / name).read_bytes())
        text = (REPOSITORY / "models/cubesat.toml").read_text()
        text = text.replace("warm_up_orbits = 1\n", "").replace("width = 320", f"width = {width}")
        scene.write_text(text.replace("height = 240", f"height = {height}"))
        simulation = isotherm.Simulation(scene)
        print(f"{arguments.size} pixels, {simulation.nodes} nodes, {simulation.device}")
        del simulation
        own = of_python(scene, arguments.images)
        if not arguments.no_program:
            # Before and after, because the speed of a machine drifts.
            rust = of_rust(scene, arguments.images)
            again = of_python(scene, arguments.images)
            files = of_the_program(scene, min(arguments.images, 2000))
            rate, work = ((one + other) / 2 for one, other in zip(own, again, strict=True))
            print(f"python over rust: {rate / rust[0]:.3f} of the images/s, {work / rust[1]:.3f} of the processor time")
            print(f"python over isotherm render --poses: {rate / files:.3f} of the images/s")


if __name__ == "__main__":
    main()
