"""Masks of a lens with distortion, for which BOP has no place: our meshes and poses, seen by a pinhole and then bent by OpenCV."""

import json

import cv2
import numpy as np

from . import raster
from .folder import Image, need, overlap, read_png, say

# Pixels of the longer side of the pinhole's image, which shows what the mask shows and a border.
FINE = 2000
BORDER = 12
LEAST = 0.99


def is_pinhole(image: Image) -> bool:
    """Whether the camera matrix alone takes points into the image."""
    return image.label()["camera"]["distortion"]["model"] == "none"


def rays(camera: dict, size: tuple[int, int]) -> np.ndarray:
    """x / z and y / z of the line of sight of each pixel, by OpenCV."""
    width, height = size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 1, 2).astype(np.float64)
    matrix, numbers = np.reshape(camera["matrix"], (3, 3)), np.array(camera["distortion"]["numbers"])
    if camera["distortion"]["model"] == "opencv_fisheye":
        found = cv2.fisheye.undistortPoints(pixels, matrix, numbers)
    else:
        often = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        found = cv2.undistortPointsIter(pixels, matrix, numbers, None, None, often)
    return found.reshape(height, width, 2)


def bent(depth: np.ndarray, matrix: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Whether the pinhole shows a surface where each pixel looks."""
    places = np.rint(seen * [matrix[0, 0], matrix[1, 1]] + [matrix[0, 2], matrix[1, 2]]).astype(np.int64)
    inside = (places >= 0).all(axis=-1) & (places < depth.shape[::-1]).all(axis=-1)
    x, y = np.where(inside, places[..., 0], 0), np.where(inside, places[..., 1], 0)
    return inside & (depth[y, x] > 0)


def load_ply(path) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of one of our files."""
    head, body = path.read_text().split("end_header\n")
    count = int(next(line.split()[2] for line in head.splitlines() if line.startswith("element vertex")))
    lines = body.splitlines()
    points = np.array([[float(word) for word in line.split()[:3]] for line in lines[:count]])
    return points, np.array([[int(word) for word in line.split()[1:]] for line in lines[count:]])


def window(mask: np.ndarray) -> tuple[slice, slice]:
    """Rows and columns of a mask with a border."""
    spans = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    rows, columns = (slice(max(0, span[0] - BORDER), span[-1] + BORDER + 1) for span in spans)
    return rows, columns


def drawn(points: np.ndarray, faces: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Whether each line of sight meets the mesh. It is looked up in the fine image of a pinhole."""
    low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
    focal = FINE / (high - low).max()
    matrix = np.array([[focal, 0, -low[0] * focal], [0, focal, -low[1] * focal], [0, 0, 1]])
    width, height = (np.ceil((high - low) * focal) + 1).astype(int)
    return bent(raster.depth(points, faces, matrix, (width, height)), matrix, seen)


def check(images: list[Image]) -> None:
    root = images[0].root
    names = json.loads((root / "models/models_info.json").read_text())
    models = {int(number): load_ply(root / f"models/obj_{int(number):06}.ply") for number in names}
    found, by_pinhole = [], []
    for image in images:
        camera = image.label()["camera"]
        scene = image.root / image.split / f"{image.orbit:06}"
        entry = json.loads((scene / "scene_camera.json").read_text())[str(image.number)]
        need(entry["cam_distortion"] == camera["distortion"], "scene_camera.json has another distortion")
        without = {**camera, "distortion": {"model": "opencv", "numbers": []}}
        for place, pose in enumerate(json.loads((scene / "scene_gt.json").read_text())[str(image.number)]):
            points, faces = models[pose["obj_id"]]
            moved = points @ np.reshape(pose["cam_R_m2c"], (3, 3)).T + np.array(pose["cam_t_m2c"])
            mask = read_png(scene / f"mask/{image.number:06}_{place:06}.png") > 0
            if mask.any():
                part, size = window(mask), mask.shape[::-1]
                found.append(overlap(drawn(moved, faces, rays(camera, size)[part]), mask[part]))
                by_pinhole.append(overlap(drawn(moved, faces, rays(without, size)[part]), mask[part]))
    say(f"distortion: masks of our meshes and poses, bent by OpenCV: IoU median {np.median(found):.4f}, least {min(found):.4f}, {len(found)} objects")
    say(f"distortion: the same by cam_K alone, as bop_toolkit draws them: IoU median {np.median(by_pinhole):.4f}")
    need(np.median(found) > LEAST, "masks, poses and distortion do not agree")
    need(np.median(by_pinhole) < np.median(found), "a lens without its distortion does not show")
    say("bop_toolkit is left out: it knows no distortion")
