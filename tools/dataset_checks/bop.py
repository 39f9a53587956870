"""Runs `calc_gt_masks.py` and `calc_gt_info.py` of bop_toolkit on our meshes, poses and depths, and compares their masks and boxes with ours.

The scripts run as they are, with three things put under them: the place of the data set, because the toolkit knows only the data sets of its own; the
tolerance of depth, which the second script has as a constant; and a renderer in numpy. The toolkit's own renderers use OpenGL, whose pixels have their centres
half a pixel beside those of its own `depth_im_to_dist_im_fast`.
"""

import contextlib
import io
import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np

from . import raster
from .folder import Image, need, overlap, read_png, say

# Tolerance of the visibility test [mm], that of the photorealistic images of BOP.
DELTA = 5
# A data set whose layout is the classic one.
KNOWN = "lm"
LEAST = 0.99


class Renderer:
    """What the scripts ask of a renderer."""

    def __init__(self, width: int, height: int, inout) -> None:
        self.size, self.inout, self.models = (width, height), inout, {}

    def add_object(self, number: int, path: str, **_: object) -> None:
        model = self.inout.load_ply(path)
        self.models[number] = model["pts"], model["faces"].astype(np.int64)

    def render_object(self, number: int, turn, place, fx, fy, cx, cy) -> dict:
        points, faces = self.models[number]
        # The centres of pixels are at +0.5 here, and at integers in raster.
        camera = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
        return {"depth": raster.depth(points @ turn.T + place.reshape(3), faces, camera, self.size)}


def excerpt(images: list[Image], folder: Path, split: str, turned: bool) -> None:
    """The images of a split as a data set of their own, whose masks and boxes are not yet known. `turned` spoils the poses by two degrees."""
    shutil.rmtree(folder, ignore_errors=True)
    base = folder / KNOWN
    base.mkdir(parents=True)
    root = images[0].root
    (base / "models").symlink_to((root / "models").resolve())
    targets = []
    for image in images:
        scene = base / split / f"{image.orbit:06}"
        scene.mkdir(parents=True, exist_ok=True)
        source = root / split / f"{image.orbit:06}"
        if not (scene / "depth").exists():
            (scene / "depth").symlink_to((source / "depth").resolve())
        for name in ("scene_camera.json", "scene_gt.json"):
            entry = json.loads((source / name).read_text())[str(image.number)]
            if turned and name == "scene_gt.json":
                c, s = np.cos(np.radians(2)), np.sin(np.radians(2))
                for pose in entry:
                    rows = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.reshape(pose["cam_R_m2c"], (3, 3))
                    pose["cam_R_m2c"] = rows.flatten().tolist()
            path = scene / name
            known = json.loads(path.read_text()) if path.exists() else {}
            path.write_text(json.dumps(known | {str(image.number): entry}))
        targets.append({"im_id": image.number, "inst_count": 1, "obj_id": 1, "scene_id": image.orbit})
    (base / "test_targets_bop19.json").write_text(json.dumps(targets))


def run_scripts(toolkit: Path, folder: Path, split: str, size: tuple[int, int], objects: list[int]) -> None:
    """Both scripts on an excerpt."""
    os.environ["BOP_PATH"] = str(folder)
    from bop_toolkit_lib import config, dataset_params, inout, misc
    from bop_toolkit_lib.rendering import renderer

    config.datasets_path = str(folder)
    split_params, model_params = dataset_params.get_split_params, dataset_params.get_model_params
    of_renderer, log = renderer.create_renderer, misc.log
    dataset_params.get_split_params = lambda *args, **named: split_params(*args, **named) | {"im_size": size}
    dataset_params.get_model_params = lambda *args, **named: model_params(*args, **named) | {"obj_ids": objects}
    renderer.create_renderer = lambda width, height, *_, **__: Renderer(width, height, inout)
    misc.log = lambda text: None
    arguments = sys.argv
    try:
        sys.argv = ["calc_gt_masks.py", "--dataset", KNOWN, "--dataset_split", split, "--datasets_path", str(folder)]
        sys.argv += ["--delta", str(DELTA)]
        masks = (toolkit / "scripts/calc_gt_masks.py").read_text()
        # Its argument is a text where a number is meant.
        masks = masks.replace('add_argument("--delta", default', 'add_argument("--delta", type=float, default')
        exec(compile(masks, "calc_gt_masks.py", "exec"), {"__name__": "calc_gt_masks"})
        own = {"dataset": KNOWN, "dataset_split": split, "delta": DELTA, "datasets_path": str(folder), "modality": None, "sensor": None}
        text = (toolkit / "scripts/calc_gt_info.py").read_text()
        marker = '\nif p["vis_visibility_masks"]:'
        need(marker in text, "calc_gt_info.py is not the script that this check knows")
        text = text.replace(marker, f"\np.update({own!r})\n{marker}", 1)
        exec(compile(text, "calc_gt_info.py", "exec"), {"__name__": "calc_gt_info"})
    finally:
        dataset_params.get_split_params, dataset_params.get_model_params = split_params, model_params
        renderer.create_renderer, misc.log, sys.argv = of_renderer, log, arguments


def overlap_of_boxes(a: list[int], b: list[int]) -> float:
    """Of boxes from the first to the last pixel."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0]) + 1
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1]) + 1
    both = max(0, width) * max(0, height)
    return both / ((a[2] + 1) * (a[3] + 1) + (b[2] + 1) * (b[3] + 1) - both)


def compare(images: list[Image], folder: Path) -> dict[str, list[float]]:
    """Overlaps of masks and boxes of all objects that show a pixel."""
    found = {"mask": [], "mask_visib": [], "bbox_obj": [], "bbox_visib": [], "count": []}
    for image in images:
        theirs = folder / KNOWN / image.split / f"{image.orbit:06}"
        ours = image.root / image.split / f"{image.orbit:06}"
        info = [json.loads((scene / "scene_gt_info.json").read_text())[str(image.number)] for scene in (ours, theirs)]
        for place, (own, other) in enumerate(zip(*info, strict=True)):
            if own["px_count_visib"] == 0 and other["px_count_visib"] == 0:
                continue
            for what in ("mask", "mask_visib"):
                name = f"{what}/{image.number:06}_{place:06}.png"
                masks = [read_png(scene / name) for scene in (ours, theirs)]
                need(all(set(np.unique(mask)) <= {0, 255} for mask in masks), f"{name} has other values than 0 and 255")
                found[what].append(overlap(*(mask > 0 for mask in masks)))
            for what in ("bbox_obj", "bbox_visib"):
                found[what].append(overlap_of_boxes(own[what], other[what]))
            found["count"].append(min(own["px_count_all"], other["px_count_all"]) / max(own["px_count_all"], other["px_count_all"], 1))
    return found


def check_opengl(images: list[Image], objects: list[int], size: tuple[int, int]) -> None:
    """Masks by the toolkit's own renderer with OpenGL, with half a pixel less than our principal point and with ours."""
    os.environ.setdefault("EGL_PLATFORM", "surfaceless")
    from bop_toolkit_lib.rendering import renderer

    try:
        with contextlib.redirect_stdout(io.StringIO()):
            drawn = renderer.create_renderer(*size, "vispy", mode="depth")
    except Exception as error:
        say(f"bop_toolkit: its renderer with OpenGL is left out: {str(error).splitlines()[0]}")
        return
    for number in objects:
        drawn.add_object(number, str(images[0].root / f"models/obj_{number:06}.ply"))
    for more in (-0.5, 0.0):
        found = []
        for image in images:
            scene = image.root / image.split / f"{image.orbit:06}"
            k = json.loads((scene / "scene_camera.json").read_text())[str(image.number)]["cam_K"]
            for place, pose in enumerate(json.loads((scene / "scene_gt.json").read_text())[str(image.number)]):
                turn, origin = np.reshape(pose["cam_R_m2c"], (3, 3)), np.reshape(pose["cam_t_m2c"], (3, 1))
                depth = drawn.render_object(pose["obj_id"], turn, origin, k[0], k[4], k[2] + more, k[5] + more)["depth"]
                mask = read_png(scene / f"mask/{image.number:06}_{place:06}.png") > 0
                if mask.any():
                    found.append(overlap(depth > 0, mask))
        say(f"bop_toolkit, mask by its OpenGL, principal point + {more}: IoU median {np.median(found):.5f}, least {min(found):.4f}")
    need(np.median(found) > LEAST, "the masks by OpenGL are not ours")


def check(images: list[Image], toolkit: Path, work: Path) -> None:
    sys.path.insert(0, str(toolkit))
    from bop_toolkit_lib import inout

    root = images[0].root
    info = inout.load_json(root / "models/models_info.json", keys_to_int=True)
    camera = inout.load_cam_params(root / "camera.json")
    from bop_toolkit_lib import misc

    for number, extents in info.items():
        points = inout.load_ply(root / f"models/obj_{number:06}.ply")["pts"]
        if len(points) < 4000:
            need(abs(misc.calc_pts_diameter(points) / extents["diameter"] - 1) < 1e-9, f"the diameter of object {number}")
        box = misc.calc_3d_bbox(*points.T)
        ours = [extents[key] for key in ("min_x", "min_y", "min_z", "size_x", "size_y", "size_z")]
        need(np.allclose(box, ours, atol=1e-6), f"the extents of object {number}")
    found, spoiled = {}, []
    for split in sorted({image.split for image in images}):
        chosen = [image for image in images if image.split == split]
        excerpt(chosen, work / "bop", split, turned=False)
        run_scripts(toolkit, work / "bop", split, camera["im_size"], list(info))
        for what, values in compare(chosen, work / "bop").items():
            found.setdefault(what, []).extend(values)
        excerpt(chosen[:5], work / "bop", split, turned=True)
        run_scripts(toolkit, work / "bop", split, camera["im_size"], list(info))
        spoiled += compare(chosen[:5], work / "bop")["mask"]
    for what, values in found.items():
        middle, low = np.median(values), np.percentile(values, 5)
        measure = "ratio" if what == "count" else "IoU"
        say(
            f"bop_toolkit, {what}: {measure} median {middle:.5f}, 5 % below {low:.5f}, least {min(values):.4f}, {len(values)} objects in {len(images)} images"
        )
        need(middle > LEAST, f"the {what} of bop_toolkit and ours have a median overlap of {middle:.4f}")
    say(f"bop_toolkit, poses turned by 2 deg: IoU median {np.median(spoiled):.4f}")
    need(np.median(spoiled) < LEAST, "a pose that is 2 deg off does not show")
    check_opengl(images, list(info), camera["im_size"])
