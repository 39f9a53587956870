"""Reads the lists of COCO with pycocotools: masks against the parts of the EXR files, boxes, and key points against the projection of OpenCV."""

import contextlib
import io
import json
from pathlib import Path

import cv2
import numpy as np
from pycocotools import mask as rle
from pycocotools.coco import COCO

from .folder import SPLITS, Image, need, say


def image_of(root: Path, name: str) -> Image:
    split, orbit, _, number = Path(name).parts
    return Image(root, split, int(orbit), int(Path(number).stem))


def check(root: Path, most: int) -> None:
    masks = points = 0
    worst = 0.0
    for split in SPLITS:
        path = root / "coco" / f"{split}.json"
        if not path.exists():
            continue
        with contextlib.redirect_stdout(io.StringIO()):
            coco = COCO(str(path))
        craft = coco.loadCats([1])[0]
        known = coco.getImgIds()
        need(len(set(coco.getAnnIds())) == len(json.loads(path.read_text())["annotations"]), "an annotation's number occurs twice")
        for number in [known[int(place)] for place in np.linspace(0, len(known) - 1, min(most, len(known)))] if known else []:
            entry = coco.loadImgs([number])[0]
            image = image_of(root, entry["file_name"])
            need((root / entry["file_name"]).exists(), f"{entry['file_name']} is not there")
            parts = image.parts()
            again = np.zeros_like(parts)
            for annotation in coco.loadAnns(coco.getAnnIds(imgIds=[number])):
                mask = coco.annToMask(annotation).astype(bool)
                need(mask.shape == parts.shape, "a mask has another size")
                need(mask.sum() == annotation["area"], "the area of a mask")
                need(list(rle.toBbox(annotation["segmentation"])) == annotation["bbox"], "the box of a mask")
                masks += 1
                if annotation["category_id"] == 1:
                    need((mask == (parts > 0)).all(), "the mask of the craft")
                    triples = np.reshape(annotation["keypoints"], (-1, 3))
                    need(len(triples) == len(craft["keypoints"]), "the number of key points")
                    seen = triples[triples[:, 2] > 0]
                    need(len(seen) == annotation["num_keypoints"], "the number of labelled key points")
                    own = projected(image)[triples[:, 2] > 0]
                    if len(seen):
                        worst = max(worst, np.abs(own - seen[:, :2]).max())
                    points += len(seen)
                else:
                    need((again[mask] == 0).all(), "two parts in one pixel")
                    again[mask] = annotation["category_id"] - 1
            need((again == parts).all(), f"the masks of {entry['file_name']} are not the parts of its pixels")
    need(masks > 0, "there is no mask")
    need(worst < 1e-6, f"key points are {worst} px from where OpenCV projects them")
    say(
        f"pycocotools: {masks} masks decode to the parts of the EXR files, pixel by pixel; {points} key points within {worst:.1e} px of OpenCV's projection"
    )


def projected(image: Image) -> np.ndarray:
    """Key points where OpenCV projects their places in camera axes."""
    label = image.label()
    matrix = np.reshape(label["camera"]["matrix"], (3, 3))
    places = np.array([point["camera_m"] for point in label["key_points"]])
    numbers = np.array(label["camera"]["distortion"]["numbers"])
    if label["camera"]["distortion"]["model"] == "opencv_fisheye":
        return cv2.fisheye.projectPoints(places.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, numbers)[0].reshape(-1, 2)
    return cv2.projectPoints(places, np.zeros(3), np.zeros(3), matrix, numbers if len(numbers) else None)[0].reshape(-1, 2)
