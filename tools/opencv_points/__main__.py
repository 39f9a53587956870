"""Renders plates with every camera model and compares their centroids with OpenCV's."""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

from opencv_points import exr, scenes
from opencv_points.scenes import CAMERAS, FRAME_FROM_CAMERA, POSITION, Camera

# Pixels.
LIMIT = 0.05
# Points along each edge of a plate.
ALONG = 64


def projected(camera: Camera, points: np.ndarray, camera_from_body: np.ndarray, change: float = 0.0) -> np.ndarray:
    """Pixels of points by OpenCV, with a change of k1."""
    matrix = np.array([[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]])
    turn, _ = cv2.Rodrigues(camera_from_body[:3, :3])
    move = camera_from_body[:3, 3]
    numbers = np.array(camera.distortion or (0.0,) * 5)
    numbers[0] += change
    if camera.fisheye:
        found, _ = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), turn, move, matrix, numbers, alpha=camera.skew / camera.fx)
        return found.reshape(-1, 2)
    if camera.skew:
        # projectPoints has no skew: the distorted rays of a camera with focal length 1, times the whole matrix.
        rays, _ = cv2.projectPoints(points, turn, move, np.eye(3), numbers)
        matrix[0, 1] = camera.skew
        return np.c_[rays.reshape(-1, 2), np.ones(len(points))] @ matrix.T[:, :2]
    found, _ = cv2.projectPoints(points, turn, move, matrix, numbers)
    return found.reshape(-1, 2)


def outline(corners: np.ndarray) -> np.ndarray:
    """Points along the edges of a plate."""
    shares = np.arange(ALONG)[:, None] / ALONG
    return np.concatenate([a + shares * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])


def centroid(polygon: np.ndarray) -> np.ndarray:
    """Centre of the area of a polygon."""
    ahead = np.roll(polygon, -1, axis=0)
    cross = polygon[:, 0] * ahead[:, 1] - ahead[:, 0] * polygon[:, 1]
    return ((polygon + ahead) * cross[:, None]).sum(axis=0) / (3.0 * cross.sum())


def seen(radiance: np.ndarray, polygon: np.ndarray) -> np.ndarray | None:
    """Centre of the radiance around a polygon, where it lies within the frame. Pixel centres are at whole numbers, as in OpenCV."""
    low, high = np.floor(polygon.min(axis=0) - 3).astype(int), np.ceil(polygon.max(axis=0) + 4).astype(int)
    if (low < 0).any() or high[0] > radiance.shape[1] or high[1] > radiance.shape[0]:
        return None
    part = radiance[low[1] : high[1], low[0] : high[0]].astype(np.float64)
    rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]]
    return np.array([(part * columns).sum(), (part * rows).sum()]) / part.sum()


def rendered(program: str, folder: Path, camera: Camera, device: str | None) -> tuple[dict, dict, np.ndarray]:
    """The image of the plates, its header, and the corners of the plates in the body frame."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(scenes.SCENE + camera.toml(), encoding="utf-8")

    def render(corners: np.ndarray) -> tuple[dict, dict]:
        scenes.write_model(folder / "plates.glb", corners)
        image = folder / "image.exr"
        command = [program, "render", str(folder / "scene.toml"), "--time", "0", "-o", str(image)]
        done = subprocess.run(command + (["--device", device] if device else []), capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"opencv_check: {camera.name}: {done.stderr}")
        return exr.read(image)

    # The body's place in a camera that is not fixed to it is known from a first image.
    body_from_camera = np.linalg.inv(render(scenes.plates(camera, np.eye(3), np.zeros(3)))[1]["isotherm_camera_from_body"])
    corners = scenes.plates(camera, body_from_camera[:3, :3], body_from_camera[:3, 3])
    channels, header = render(corners)
    return channels, header, corners


def check(program: str, folder: Path, camera: Camera, device: str | None) -> dict:
    """The largest distances of a camera."""
    channels, header, corners = rendered(program, folder, camera, device)
    pose = header["isotherm_camera_from_body"]
    # The header has the stated pose in the camera's own frame, and OpenCV's numbers.
    own = header[f"isotherm_camera_from_{camera.frame}"]
    stated = np.eye(4)
    stated[:3, :3], stated[:3, 3] = FRAME_FROM_CAMERA, POSITION
    expected = [[camera.fx, camera.skew, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
    numbers = np.array([float(word) for word in header["isotherm_camera_distortion"].split()])
    assert np.abs(own @ stated - np.eye(4)).max() < 1e-9, "the pose in the camera's own frame"
    assert np.abs(header["isotherm_camera_opencv_matrix"] - expected).max() < 1e-9, "OpenCV's matrix"
    assert np.array_equal(numbers[: len(camera.distortion)], camera.distortion) and not numbers[len(camera.distortion) :].any()

    distances, changed, depths, plates = [], [], [], 0
    names = header["isotherm_parts"]
    for number, plate in enumerate(corners):
        points = outline(plate)
        polygon = projected(camera, points, pose)
        found = seen(channels["L"], polygon)
        if found is None:
            continue
        plates += 1
        distances.append(np.linalg.norm(found - centroid(polygon)))
        changed.append(np.linalg.norm(found - centroid(projected(camera, points, pose, 0.02))))
        # Part and depth at the centre of the plate.
        centre = plate.mean(axis=0)
        column, row = np.rint(projected(camera, centre[None], pose)[0]).astype(int)
        assert names[channels["part"][row, column]] == f"plate_{number}", f"the part at ({column}, {row})"
        depths.append(abs(channels["Z"][row, column] / (pose[:3, :3] @ centre + pose[:3, 3])[2] - 1.0))
    return {
        "camera": camera.name,
        "plates": plates,
        "mean_px": float(np.mean(distances)),
        "largest_px": float(np.max(distances)),
        "with_k1_changed_px": float(np.max(changed)),
        "depth": float(np.max(depths)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="tools/opencv_check", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for scenes, images and result.json")
    parser.add_argument("--device", help="device of isotherm, or cpu for the f64 reference")
    arguments = parser.parse_args()
    program = os.environ.get("ISOTHERM", "isotherm")
    rows = []
    print(f"OpenCV {cv2.__version__}; centroids of plates, distance in px: mean, largest, and largest where OpenCV's k1 is changed by 0.02")
    for number, camera in enumerate(CAMERAS):
        row = check(program, arguments.output / f"{number:02}", camera, arguments.device)
        rows.append(row)
        print(
            f"{row['camera']:<34} {row['plates']:>3} plates {row['mean_px']:8.4f} {row['largest_px']:8.4f} {row['with_k1_changed_px']:8.3f}", flush=True
        )
    (arguments.output / "result.json").write_text(json.dumps({"opencv": cv2.__version__, "rows": rows}, indent=1), encoding="utf-8")
    # A comparison that a wrong k1 would pass is none.
    wrong = [row["camera"] for row in rows if row["largest_px"] > LIMIT or row["with_k1_changed_px"] <= LIMIT or row["plates"] < 8]
    if wrong:
        sys.exit(f"opencv_check: beyond {LIMIT} px: {', '.join(wrong)}")
    print(f"all within {LIMIT} px")


if __name__ == "__main__":
    main()
