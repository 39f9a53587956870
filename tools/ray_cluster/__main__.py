"""Makes a data set three times: in this process, on a cluster of two workers of which one is killed, and into an object store. All must have the same checksums."""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import sys
import tempfile
import threading
import time
from pathlib import Path

# The workers of Ray have the least priority otherwise, and starve where tests run beside them.
os.environ.setdefault("RAY_worker_niceness", "0")
os.environ.setdefault("RAY_AUTH_MODE", "disabled")

import ray
from ray.cluster_utils import Cluster

from isotherm import _native
from isotherm.dataset import run

LIST = "checksums.sha256"


def checksum(folder: Path) -> str:
    """That of the list of checksums, after all files agree with it."""
    for line in (folder / LIST).read_text().splitlines():
        sum_, name = line.split("  ", 1)
        if hashlib.sha256((folder / name).read_bytes()).hexdigest() != sum_:
            sys.exit(f"{folder / name} is not what the list says")
    return hashlib.sha256((folder / LIST).read_bytes()).hexdigest()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spec", type=Path)
    parser.add_argument("--samples", type=int, help="in place of that of the SPEC")
    parser.add_argument("--poses-per-orbit", type=int)
    asked = parser.parse_args()
    work = Path(tempfile.mkdtemp(prefix="ray-", dir=Path("target")))
    shutil.copytree(asked.spec.parent, work / "spec")
    spec = work / "spec" / asked.spec.name
    changed = {"samples": asked.samples, "poses_per_orbit": asked.poses_per_orbit}
    lines = spec.read_text().splitlines()
    for key, value in changed.items():
        lines = [f"{key} = {value}" if value and line.startswith(f"{key} =") else line for line in lines]
    spec.write_text("\n".join(lines) + "\n")
    spec = spec.absolute()

    began = time.monotonic()
    _native.make_dataset(spec, work / "alone")
    print(f"alone: {time.monotonic() - began:.0f} s")

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    nodes = [cluster.add_node(num_cpus=1) for _ in range(2)]
    ray.init(address=cluster.address, logging_level="warning", log_to_driver=False)
    together = (work / "together").absolute()

    def kill_one() -> None:
        while len(list(together.glob(f"*/*/{LIST}"))) < 2:
            time.sleep(0.2)
        cluster.remove_node(nodes[1], allow_graceful=False)
        print("a worker was killed", flush=True)

    killer = threading.Thread(target=kill_one)
    killer.start()
    told = run(str(spec), str(together), cluster.address)
    killer.join()
    print(f"cluster: {told}")
    # The name of this protocol is not that of a folder, so files go the way to an object store.
    stored = run(str(spec), f"local://{(work / 'stored').absolute()}", cluster.address)
    print(f"object store: {stored}")
    ray.shutdown()
    cluster.shutdown()

    sums = {name: checksum(work / name) for name in ("alone", "together", "stored")}
    for name, found in sums.items():
        print(f"{found}  {name}")
    if len(set(sums.values())) != 1:
        sys.exit("the checksums differ")
    shutil.rmtree(work)
    print("ok: three folders with equal checksums")


if __name__ == "__main__":
    main()
