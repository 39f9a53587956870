"""Trains a small network for minutes, as a smoke test that images and labels agree: distance and direction from the image alone."""

import json
from pathlib import Path

import numpy as np
from PIL import Image as Pillow
from sklearn.neural_network import MLPRegressor
from sklearn.preprocessing import StandardScaler

from .folder import need, say

# Pixels of a row or column that are taken together.
STEP = 4
# How much smaller the error must be than that of the mean of the training labels.
FACTOR = {"distance": 2.0, "direction": 2.0}
# What the shuffled labels may reach at most.
CONTROL = 1.1


def features(path: Path) -> np.ndarray:
    """How many pixels differ from the background in each stripe of rows, in each of columns, and in all (logarithms)."""
    pixels = np.array(Pillow.open(path)).astype(np.float32)
    off = np.abs(pixels - np.median(pixels))
    shown = np.tanh(np.maximum(off / (np.median(off) + 1) - 4, 0) / 8)
    stripes = [shown.sum(axis=axis) for axis in (1, 0)]
    stripes = [values[: len(values) // STEP * STEP].reshape(-1, STEP).sum(axis=1) for values in stripes]
    return np.log1p(np.concatenate([*stripes, [shown.sum()]]))


def read(root: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Images, and distance (its logarithm) and direction (x / z and y / z) of the craft."""
    entries = json.loads((root / "speed" / f"{name}.json").read_text())
    places = np.array([entry["r_Vo2To_vbs_true"] for entry in entries])
    labels = np.column_stack([np.log(np.linalg.norm(places, axis=1)), places[:, 0] / places[:, 2], places[:, 1] / places[:, 2]])
    return np.stack([features(root / entry["filename"]) for entry in entries]), labels


def factors(train, train_labels, test, test_labels) -> dict[str, float]:
    """Error of the mean over error of the network, on the test split."""
    scale, label_scale = StandardScaler().fit(train), StandardScaler().fit(train_labels)
    network = MLPRegressor(hidden_layer_sizes=(128, 32), early_stopping=True, n_iter_no_change=25, max_iter=300, alpha=1e-2, random_state=1)
    network.fit(scale.transform(train), label_scale.transform(train_labels))
    found = label_scale.inverse_transform(network.predict(scale.transform(test)))
    rms = lambda values: np.sqrt((values**2).mean())
    off, mean = found - test_labels, train_labels.mean(axis=0) - test_labels
    return {"distance": rms(mean[:, 0]) / rms(off[:, 0]), "direction": rms(mean[:, 1:]) / rms(off[:, 1:])}


def check(root: Path) -> None:
    train, train_labels = read(root, "train")
    test, test_labels = read(root, "test")
    say(f"training: {len(train)} images, tests with {len(test)} of other orbits")
    own = factors(train, train_labels, test, test_labels)
    order = np.random.default_rng(1).permutation(len(train))
    control = factors(train, train_labels[order], test, test_labels)
    for what, factor in own.items():
        say(f"training: {what} {factor:.2f} times better than the mean; with shuffled labels {control[what]:.2f} times")
        need(factor > FACTOR[what], f"the {what} is not {FACTOR[what]} times better than the mean")
        need(control[what] < CONTROL, f"shuffled labels do not fail for the {what}")
