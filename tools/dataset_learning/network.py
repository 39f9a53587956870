"""Small networks that find distance and direction of a craft, and how far they are off."""

from __future__ import annotations

import numpy as np
from sklearn.neural_network import MLPRegressor
from sklearn.preprocessing import StandardScaler

# Networks that differ in their random beginning. Their mean is taken.
NETWORKS = 8


def found(train: np.ndarray, labels: np.ndarray, test: np.ndarray) -> np.ndarray:
    """What networks that are trained on some images find in others."""
    scale, scale_labels = StandardScaler().fit(train), StandardScaler().fit(labels)
    outputs = []
    for seed in range(NETWORKS):
        network = MLPRegressor(hidden_layer_sizes=(128, 32), alpha=1e-2, early_stopping=True, n_iter_no_change=25, max_iter=300, random_state=seed)
        network.fit(scale.transform(train), scale_labels.transform(labels))
        outputs.append(network.predict(scale.transform(test)))
    return scale_labels.inverse_transform(np.mean(outputs, axis=0))


def errors(values: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Root mean squares: of the logarithm of found over true distance, and of the angle between found and true direction [deg]."""
    cosines = (directions(values) * directions(labels)).sum(axis=1)
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    return np.sqrt(np.array([np.mean((values[:, 0] - labels[:, 0]) ** 2), np.mean(angles**2)]))


def directions(labels: np.ndarray) -> np.ndarray:
    """Unit vectors in camera axes."""
    vectors = np.column_stack([labels[:, 1:], np.ones(len(labels))])
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
