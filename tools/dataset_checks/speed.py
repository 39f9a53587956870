"""Projects key points with the lists in the style of SPEED+, by the rule of spnv2, and looks for them in the EXR files."""

import json
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from .coco import image_of
from .folder import OPENCV_PIXEL, need, say

NAMES = ("train", "validation", "test")
# Most distance of a key point [px].
MOST = 0.5


def turn_of(q: list[float]) -> np.ndarray:
    """The quaternion (w, x, y, z) as scipy has it: body vectors into camera axes."""
    return Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()


def quat2dcm(q: list[float]) -> np.ndarray:
    """Direction cosines of camera axes in the body, for the same quaternion: what the function of this name in spnv2 returns."""
    w, x, y, z = np.array(q) / np.linalg.norm(q)
    vector = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - vector @ vector) * np.eye(3) + 2 * np.outer(vector, vector) - 2 * w * cross


def project(turn: np.ndarray, place: np.ndarray, camera: dict, points: np.ndarray) -> np.ndarray:
    """Key points [px], with the distortion of OpenCV."""
    import cv2

    seen = points @ turn.T + place
    matrix, numbers = np.array(camera["cameraMatrix"]), np.array(camera["distCoeffs"])
    if camera["distModel"] == "opencv_fisheye":
        return cv2.fisheye.projectPoints(seen.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, numbers)[0].reshape(-1, 2)
    return cv2.projectPoints(seen, np.zeros(3), np.zeros(3), matrix, numbers)[0].reshape(-1, 2)


def check(root: Path, most: int) -> None:
    camera = json.loads((root / "speed/camera.json").read_text())
    points = json.loads((root / "speed/keypoints.json").read_text())
    places = np.array([point["position"] for point in points])
    near, by_pose, other_way, images = [], [], [], 0
    for name in NAMES:
        path = root / "speed" / f"{name}.json"
        entries = json.loads(path.read_text()) if path.exists() else []
        for entry in [entries[int(place)] for place in np.linspace(0, len(entries) - 1, min(most, len(entries)))] if entries else []:
            need((root / entry["filename"]).exists(), f"{entry['filename']} is not there")
            image, images = image_of(root, entry["filename"]), images + 1
            label = image.label()
            turn, place = turn_of(entry["q_vbs2tango_true"]), np.array(entry["r_Vo2To_vbs_true"])
            need(np.allclose(quat2dcm(entry["q_vbs2tango_true"]).T, turn, atol=1e-12), "spnv2 and scipy have another rotation")
            moved = places.copy()
            for at, point in enumerate(points):
                link = label["body_from_link"][point["link"]]
                moved[at] = np.reshape(link["R"], (3, 3)) @ places[at] + link["t_m"]
            found = project(turn, place, camera, moved)
            seen = np.array([point["visibility"] for point in label["key_points"]]) == 2
            parts = image.parts()
            rows, columns = np.nonzero(parts)
            tree = cKDTree(np.stack([columns, rows], axis=1))
            # From the square of the nearest pixel that shows the craft.
            distance = tree.query(found[seen], p=np.inf)[0] if seen.any() else np.empty(0)
            near += list(np.maximum(0, distance - 0.5))
            exr = image.exr()
            if exr is not None:
                header = exr.header()
                pose = np.reshape(header["isotherm_camera_from_body"], (4, 4))
                focal, centre = (np.array(header[f"isotherm_camera_{key}"]) for key in ("focal_px", "centre_px"))
                own = {"cameraMatrix": np.diag([*focal, 1.0]), "distModel": camera["distModel"]}
                own["cameraMatrix"][:2, 2] = centre + OPENCV_PIXEL
                own["distCoeffs"] = np.array(header.get("isotherm_camera_distortion", "").split(), dtype=float)
                by_pose += list(np.linalg.norm(project(pose[:3, :3], pose[:3, 3], own, moved) - found, axis=1)[seen])
            wrong = project(turn.T, place, camera, moved)
            other_way += list(np.linalg.norm(wrong - found, axis=1)[seen])
    need(images > 0, "the lists of SPEED+ are empty")
    near = np.array(near)
    say(
        f"SPEED+: {len(near)} visible key points of {images} images; from the nearest pixel of the craft: median {np.median(near):.3f} px, "
        f"{100 * (near < MOST).mean():.1f} % below {MOST} px, greatest {near.max():.2f} px (the tip of a corner may miss every centre of a pixel)"
    )
    need(np.median(near) < MOST, "key points do not lie on the craft of the EXR files")
    if by_pose:
        say(f"SPEED+: at most {max(by_pose):.2e} px from the projection by the pose and the lens in the EXR files")
        need(max(by_pose) < MOST, "key points do not lie where the EXR files have them")
    say(f"SPEED+: with the quaternion the other way round, half of them are more than {np.median(other_way):.1f} px away")
    need(np.median(other_way) > MOST, "the way of the quaternion does not show")
