"""Data sets made by a Ray cluster on this machine: with a worker that is killed, and into an object store."""

from __future__ import annotations

import os
import random
import threading
import time
from pathlib import Path

# The workers of Ray have the least priority otherwise, and starve where other programs run beside them.
os.environ.setdefault("RAY_worker_niceness", "0")
os.environ.setdefault("RAY_AUTH_MODE", "disabled")

import ray
from isotherm.dataset import run
from ray.cluster_utils import Cluster

from . import folder


class Workers:
    """A cluster of two workers."""

    def __init__(self) -> None:
        self._cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
        self._workers = [self._cluster.add_node(num_cpus=1) for _ in range(2)]
        ray.init(address=self._cluster.address, logging_level="warning", log_to_driver=False)

    def make(self, spec: Path, output: str) -> None:
        """A data set in a folder or an object store."""
        run(str(spec), output, self._cluster.address, allow_outside=True)

    def make_and_lose(self, spec: Path, output: Path, orbits: int, seed: int) -> None:
        """A data set in a folder. A worker is killed after a random number of orbits."""
        times = random.Random(seed)
        after, late = times.randint(1, max(1, orbits // 2)), times.uniform(0, 1)

        def kill() -> None:
            while folder.orbits(output) < after:
                time.sleep(0.1)
            time.sleep(late)
            self._cluster.remove_node(self._workers.pop(), allow_graceful=False)
            print(f"  a worker was killed {late:.1f} s after {after} orbits were whole", flush=True)

        killer = threading.Thread(target=kill)
        killer.start()
        self.make(spec, str(output))
        killer.join()

    def end(self) -> None:
        """Ends the cluster."""
        ray.shutdown()
        self._cluster.shutdown()
