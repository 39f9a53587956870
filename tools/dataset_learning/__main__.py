"""Trains small networks on the images of a data set to find the craft's distance and direction, as a smoke test that images and labels agree."""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# How many times smaller the error must be than that of the mean of the training labels, for the distance and for the direction.
FACTOR = 2.0
# Most that networks with shuffled labels may reach.
CONTROL = 1.2
# Images that are made, and how many of them share an orbit.
IMAGES, POSES = 2000, 50


def arguments() -> argparse.Namespace:
    """What the caller asks for."""
    ends = f"""They see the images of the train split alone. On those of the test split, the error of the distance (as a ratio) and that of the direction
(as an angle) must each be {FACTOR} times smaller than with the mean of the training labels. Networks that are trained with shuffled labels must not be more than
{CONTROL} times better than that mean. Otherwise the command ends with 1."""
    parser = argparse.ArgumentParser(prog="tools/dataset_learns", description=__doc__, epilog=ends)
    parser.add_argument("folder", type=Path, nargs="?", help=f"a data set (default: {IMAGES} images of models/cubesat_dataset.toml are made first)")
    parser.add_argument("--program", type=Path, help=argparse.SUPPRESS)
    return parser.parse_args()


def made(program: Path, work: Path) -> Path:
    """A data set of the CubeSat with nothing but digital numbers and labels."""
    from dataset_ways.spec import copy

    changed = {"samples": IMAGES, "poses_per_orbit": POSES, "images": '["numbers"]'}
    spec = copy(Path("models/cubesat_dataset.toml"), work / "spec", changed)
    print(f"making {IMAGES} images of the CubeSat ...", flush=True)
    if subprocess.run([program, "dataset", spec, "-o", work / "set"], stdout=subprocess.DEVNULL).returncode:
        sys.exit("the data set could not be made")
    return work / "set"


def check(root: Path) -> bool:
    """Trains, tests, and tells what came of it."""
    import numpy as np

    from . import network, samples

    train, labels = samples.read(root, "train")
    test, true = samples.read(root, "test")
    print(f"{len(train)} images to train with, {len(test)} of other orbits to test with")
    mean = network.errors(np.tile(labels.mean(axis=0), (len(true), 1)), true)
    own = network.errors(network.found(train, labels, test), true)
    shuffled = np.random.default_rng(1).permutation(labels)
    control = network.errors(network.found(train, shuffled, test), true)
    print("\n| error on the test split (root mean square) | mean of the training labels | network | better by | with shuffled labels, better by |")
    print("|---|---|---|---|---|")
    named = [("distance, found over true", lambda value: f"a factor {np.exp(value):.3f}"), ("direction", lambda value: f"{value:.2f} deg")]
    for (name, shown), of_mean, of_own, of_control in zip(named, mean, own, control, strict=True):
        print(f"| {name} | {shown(of_mean)} | {shown(of_own)} | {of_mean / of_own:.2f} | {of_mean / of_control:.2f} |")
    print()
    learns, fails = (mean / own >= FACTOR).all(), (mean / control <= CONTROL).all()
    if not learns:
        print(f"FAILED: the network is not {FACTOR} times better than the mean: images and labels do not agree")
    if not fails:
        print(f"FAILED: with shuffled labels it is more than {CONTROL} times better than the mean: the test finds what is not there")
    return bool(learns and fails)


def main() -> int:
    """The command."""
    asked = arguments()
    if asked.folder:
        if not (asked.folder / "speed").is_dir():
            sys.exit(f"{asked.folder} is no data set")
        return 0 if check(asked.folder) else 1
    work = Path(tempfile.mkdtemp(prefix="learns-", dir="target")).absolute()
    try:
        return 0 if check(made(asked.program.absolute(), work)) else 1
    finally:
        shutil.rmtree(work)


if __name__ == "__main__":
    sys.exit(main())
