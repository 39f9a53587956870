"""python -m dataset_checks FOLDER WORK [--images N] [--toolkit PATH]"""

import argparse
from pathlib import Path

from . import coco, detection, distorted, speed, web
from .folder import images, need, say


def main() -> None:
    parser = argparse.ArgumentParser(prog="dataset_check")
    parser.add_argument("folder", type=Path, help="the data set")
    parser.add_argument("work", type=Path, help="a folder for what bop_toolkit writes")
    parser.add_argument("--images", type=int, default=30, help="images that are looked at closely; the tars are read whole")
    parser.add_argument("--toolkit", type=Path, help="a copy of thodan/bop_toolkit")
    arguments = parser.parse_args()
    root = arguments.folder
    need((root / "README.txt").exists(), f"{root} is no data set")
    arguments.work.mkdir(parents=True, exist_ok=True)
    chosen = images(root, arguments.images)
    say(f"{len(images(root))} images; {len(chosen)} are looked at closely")
    coco.check(root, arguments.images)
    speed.check(root, arguments.images)
    detection.check(root, arguments.images)
    web.check(root, arguments.toolkit, arguments.work)
    if not distorted.is_pinhole(chosen[0]):
        distorted.check(chosen)
    elif arguments.toolkit:
        from . import bop

        bop.check(chosen, arguments.toolkit, arguments.work)
    say("all right")


main()
