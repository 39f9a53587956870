"""Loops over all samples of the WebDataset with `webdataset` and with `datasets` of Hugging Face, and opens one with bop_toolkit."""

import io
import json
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image as Pillow

from .folder import SPLITS, images, need, say


def check(root: Path, toolkit: Path | None, work: Path) -> None:
    tars = {split: sorted(str(path) for path in (root / split).glob("*/webdataset.tar")) for split in SPLITS}
    tars = {split: paths for split, paths in tars.items() if paths}
    need(bool(tars), "there is no tar")
    known = {(image.split, f"{image.orbit:06}_{image.number:06}"): image for image in images(root)}
    import webdataset

    found = set()
    for split, paths in tars.items():
        for sample in webdataset.WebDataset(paths, shardshuffle=False):
            key = (split, sample["__key__"])
            need(key in known and key not in found, f"the sample {key} is not in the folder, or there twice")
            found.add(key)
            label = json.loads(sample["json"])
            need([label["orbit"], label["image"]] == [known[key].orbit, known[key].number], f"the label of {key}")
            for ending in ("depth.png", "part.png", "temperature.png"):
                need(sample[ending] == known[key].path(ending.split(".")[0], "png").read_bytes(), f"{ending} of {key}")
            if "gray.png" in sample:
                numbers = np.array(Pillow.open(io.BytesIO(sample["gray.png"]))).astype(np.int64)
                eight = np.array(Pillow.open(io.BytesIO(sample["gray8.png"])))
                need(eight.dtype == np.uint8 and (eight == numbers >> (label["bits"] - 8)).all(), f"the 8 bits of {key}")
            parts = np.array(Pillow.open(io.BytesIO(sample["part.png"])))
            need(parts.shape == (label["height"], label["width"]), f"the size of {key}")
    need(found == set(known), f"{len(known) - len(found)} samples are in no tar")
    say(f"webdataset: {len(found)} samples of {sum(len(paths) for paths in tars.values())} tars, all that the folder has")

    os.environ.update({"HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1", "HF_HOME": str(work / "huggingface")})
    from datasets import load_dataset

    counted = 0
    for sample in (sample for split in tars for sample in load_dataset("webdataset", data_files={split: tars[split]}, split=split, streaming=True)):
        need(sample["json"]["width"] == sample["part.png"].width, "the size of an image")
        counted += 1
    need(counted == len(known), f"datasets has {counted} samples of {len(known)}")
    say(f"datasets: {counted} samples")
    index = root / "index.parquet"
    if index.exists():
        rows = load_dataset("parquet", data_files=str(index), split="train", streaming=True)
        need(sum(1 for _ in rows) == len(known), "the index has another number of rows")
        say(f"datasets: {len(known)} rows of index.parquet")
    card(root, known)
    if toolkit is not None:
        sys.path.insert(0, str(toolkit))
        from bop_toolkit_lib.dataset import bop_webdataset

        split, paths = next(iter(tars.items()))
        key = next(key for key in sorted(known) if key[0] == split)
        path = next(path for path in paths if key[1] in {member.split(".")[0] for member in members(path)})
        data = bop_webdataset.load_image_data(path, key[1], load_rgb=False, load_mask=True, load_gt=True, load_gt_info=True)
        parts = known[key].parts()
        need((data["mask_visib"].any(axis=0) == (parts > 0)).all(), "the masks of BOP-webdataset")
        need(np.array_equal(data["im_depth"] > 0, parts > 0), "the depth of BOP-webdataset")
        need(len(data["gt"]) == len(data["gt_info"]) == len(data["mask"]), "the poses of BOP-webdataset")
        say("bop_toolkit: a sample of BOP-webdataset opens, with its masks and depth")


def card(root: Path, known: dict) -> None:
    """Each configuration of the card has its own files alone, one for each image, or for each object of an image."""
    from datasets import get_dataset_config_names, load_dataset

    names = get_dataset_config_names(str(root))
    need("depth" in names and ("gray" in names) == any(root.glob("*/*/gray")), f"the card has the configurations {names}")
    counted = {}
    for name in names:
        loaded = load_dataset(str(root), name, streaming=True)
        counted[name] = sum(1 for split in loaded.values() for _ in split)
        need(set(loaded) <= {"train", "validation", "test"}, f"the splits of {name}")
    masks = sum(1 for split in SPLITS for _ in (root / split).glob("*/mask/*.png"))
    expected = {name: masks if name.startswith("mask") else len(known) for name in names}
    need(counted == expected, f"datasets counts {counted} instead of {expected}")
    picture = next(iter(load_dataset(str(root), "gray8" if "gray8" in names else "depth", streaming=True).values()))
    sample = next(iter(picture))
    need(list(sample) == ["image"], f"a sample has {list(sample)}")
    say(f"datasets: {len(names)} configurations of the card, each with its own files: {', '.join(names)}")


def members(path: str) -> list[str]:
    import tarfile

    with tarfile.open(path) as archive:
        return archive.getnames()
