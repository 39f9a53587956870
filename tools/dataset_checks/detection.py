"""Reads the labels of YOLO and KITTI as their loaders do, and compares their boxes with the map of parts."""

from pathlib import Path

import numpy as np

from .folder import SPLITS, Image, need, read_png, say


def check(root: Path, most: int) -> None:
    yaml = root / "yolo.yaml"
    if not yaml.exists():
        return
    counted = away = 0
    worst = 0.0
    for line in yaml.read_text().splitlines():
        split, _, name = line.partition(": ")
        if split not in SPLITS:
            continue
        # The lists as Ultralytics reads them: "./" is the folder of the list, and the label has the name of the picture.
        pictures = [root / path.removeprefix("./") for path in (root / name).read_text().split()]
        need(all(picture.exists() for picture in pictures), f"a picture of {name} is not there")
        for place in np.linspace(0, len(pictures) - 1, min(most, len(pictures))):
            picture = pictures[int(place)]
            # Another split stands in for one without orbits.
            image = Image(root, picture.relative_to(root).parts[0], int(picture.parts[-3]), int(picture.stem))
            parts = read_png(image.path("part", "png")) > 0
            label, kitti = picture.with_suffix(".txt").read_text().split(), image.path("kitti", "txt").read_text().split()
            counted += 1
            if not parts.any():
                need(not label and not kitti, f"{picture} has no craft")
                away += 1
                continue
            rows, columns = np.where(parts.any(1))[0], np.where(parts.any(0))[0]
            height, width = parts.shape
            x, y, w, h = (float(number) for number in label[1:5])
            box = [(x - w / 2) * width, (y - h / 2) * height, (x + w / 2) * width - 1, (y + h / 2) * height - 1]
            expected = [columns[0], rows[0], columns[-1], rows[-1]]
            worst = max(worst, np.abs(np.subtract(box, expected)).max(), np.abs(np.subtract([float(n) for n in kitti[4:8]], expected)).max())
            need(len(kitti) == 15 and (len(label) - 5) % 3 == 0, f"the fields of {picture}")
            points = np.reshape([float(number) for number in label[5:]], (-1, 3))
            need(bool(((points[:, :2] >= 0) & (points[:, :2] <= 1)).all()), f"key points of {picture} beyond the frame")
    need(counted > 0 and worst < 1e-3, f"boxes are {worst} px off")
    say(f"YOLO and KITTI: boxes of {counted} images within {worst:.1e} px of the map of parts, {away} without the craft")
