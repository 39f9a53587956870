"""Makes a data set on a Ray cluster: ``python -m isotherm.dataset SPEC.toml -o URI --ray ADDRESS``.

Each orbit is a Ray task. A task whose worker is lost is done again elsewhere. The files are those of ``isotherm dataset SPEC.toml -o DIR`` on one machine with the same kind
of device, to the byte. Started again, the command makes the orbits that are missing.

The SPEC and its scene must have the same path on every machine. The output is a folder that all machines share, or an object store that fsspec knows, such as ``s3://bucket/set``.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from . import _native
from ._errors import IsothermError

if not hasattr(_native, "make_dataset"):
    raise ImportError(
        "this package was built without data sets: pip install ./python -C build-args='--features datasets', or `isotherm dataset`"
    )

# A list of checksums is written last, so it says that its orbit is whole.
_CHECKSUMS = "checksums.sha256"
_OF_ORBIT = ("orbit.json", _CHECKSUMS)
# What a data set was begun with, so that none goes on with another SPEC, scene or device.
_IDENTITY = Path(".isotherm", "dataset.json")
_REPORT = "report-ray.json"


class _Store:
    """A folder of an object store."""

    def __init__(self, uri: str) -> None:
        self._files, root = import_module("fsspec").core.url_to_fs(uri)
        self._root = root.rstrip("/")

    def orbits(self) -> list[str]:
        """Places of the orbits that are whole, such as ``train/000012``."""
        found = self._files.glob(f"{self._root}/*/*/{_CHECKSUMS}")
        return ["/".join(path.split("/")[-3:-1]) for path in found]

    def get(self, place: str, name: str, into: Path) -> None:
        (into / place).mkdir(parents=True, exist_ok=True)
        self._files.get_file(f"{self._root}/{place}/{name}", str(into / place / name))

    def get_identity(self, folder: Path) -> None:
        """Puts what the data set was begun with, if it was begun, into a folder that stands for it."""
        if self._files.exists(f"{self._root}/{_IDENTITY.as_posix()}"):
            self.get(_IDENTITY.parent.as_posix(), _IDENTITY.name, folder)

    def put(self, folder: Path) -> None:
        """The files of a data set but its reports and the records of processes, lists of checksums last."""
        paths = [path for path in folder.rglob("*") if path.is_file() and _is_of_set(path.relative_to(folder))]
        for path in sorted(paths, key=lambda path: (path.name == _CHECKSUMS, path)):
            target = f"{self._root}/{path.relative_to(folder).as_posix()}"
            self._files.makedirs(target.rsplit("/", 1)[0], exist_ok=True)
            self._files.put_file(str(path), target)

    def write(self, name: str, text: str) -> None:
        self._files.pipe_file(f"{self._root}/{name}", text.encode())


def _is_of_set(path: Path) -> bool:
    if path.parts[0] == _IDENTITY.parts[0]:
        return path == _IDENTITY
    return not (len(path.parts) == 1 and path.name.startswith("report-"))


def _folder(uri: str) -> Path | None:
    """The folder that a URI names, or ``None`` for an object store."""
    if uri.startswith("file://"):
        return Path(uri.removeprefix("file://"))
    return None if "://" in uri else Path(uri).absolute()


@contextmanager
def _scratch(store: _Store, uri: str) -> Iterator[Path]:
    """A folder on this machine that stands for an object store, with what the data set was begun with."""
    with tempfile.TemporaryDirectory(prefix="isotherm-") as scratch:
        folder = Path(scratch, "set")
        store.get_identity(folder)
        try:
            yield folder
        except IsothermError as error:
            other = str(error).removeprefix(f"{folder} holds a data set with another ")
            if other == str(error):
                raise
            what = other.split(";")[0]
            raise type(error)(f"{uri} holds a data set with another {what}; name another place") from None


def make_orbit(spec: str, uri: str, orbit: int, orbits: int, device: str | None, outside: bool) -> dict[str, Any]:
    """Makes one orbit, on the worker where it is called."""
    options: dict[str, Any] = {"shard": orbit, "shards": orbits, "device": device, "allow_outside": outside}
    folder = _folder(uri)
    if folder is not None:
        made = _native.make_dataset(spec, folder, **options)
        (folder / f"report-{orbit}-of-{orbits}.json").unlink(missing_ok=True)
        return made
    store = _Store(uri)
    with _scratch(store, uri) as folder:
        made = _native.make_dataset(spec, folder, **options)
        store.put(folder)
        return made


def finish(spec: str, uri: str, orbits: int, device: str | None, outside: bool) -> bool:
    """Writes the files of the whole set. Returns whether all orbits are there."""

    def make(folder: Path) -> bool:
        # A shard without orbits.
        options: dict[str, Any] = {"shard": orbits, "shards": orbits + 1, "device": device, "allow_outside": outside}
        complete = _native.make_dataset(spec, folder, **options)["complete"]
        (folder / f"report-{orbits}-of-{orbits + 1}.json").unlink(missing_ok=True)
        return bool(complete)

    folder = _folder(uri)
    if folder is not None:
        return make(folder)
    store = _Store(uri)
    with _scratch(store, uri) as folder:
        make(folder)
        for place in store.orbits():
            for name in _OF_ORBIT:
                store.get(place, name, folder)
        complete = make(folder)
        for place in store.orbits():
            for name in _OF_ORBIT:
                (folder / place / name).unlink()
        store.put(folder)
        return complete


def run(
    spec: str,
    uri: str,
    address: str,
    *,
    device: str | None = None,
    gpus: float = 0.0,
    retries: int = 8,
    allow_outside: bool = False,
) -> dict[str, Any]:
    """Makes a data set on the Ray cluster at ``address``; ``"local"`` starts one on this machine. Returns what was done."""
    ray = import_module("ray")
    orbits = _native.dataset_orbits(spec, allow_outside=allow_outside)
    folder = _folder(uri)
    if folder is None:
        there = {int(place.split("/")[1]) for place in _Store(uri).orbits()}
    else:
        there = {int(path.parent.name) for path in folder.glob(f"*/*/{_CHECKSUMS}")}
    if not ray.is_initialized():
        ray.init(address=None if address == "local" else address, logging_level="warning", log_to_driver=False)
    began = time.monotonic()
    settings: dict[str, Any] = {"max_retries": retries, "retry_exceptions": [OSError], "num_gpus": gpus}
    task = ray.remote(**settings)(make_orbit)
    pending = [
        task.options(name=f"isotherm dataset, orbit {orbit} of {orbits}").remote(
            spec, uri, orbit, orbits, device, allow_outside
        )
        for orbit in range(orbits)
        if orbit not in there
    ]
    told: dict[str, Any] = {"orbits": 0, "orbits_kept": orbits - len(pending), "images": 0, "bytes": 0, "warnings": []}
    while pending:
        done, pending = ray.wait(pending, num_returns=1)
        for made in ray.get(done):
            told["orbits"] += made["orbits"]
            told["images"] += made["images"]
            told["bytes"] += made["bytes"]
            # Orbits of one scene have the same to tell.
            for warning in made["warnings"]:
                if warning not in told["warnings"]:
                    told["warnings"].append(warning)
                    print(f"warning: {warning}", file=sys.stderr, flush=True)
        print(f"{orbits - len(pending)} of {orbits} orbits, {told['images']} images", file=sys.stderr, flush=True)
    told["complete"] = ray.get(
        ray.remote(**settings)(finish)
        .options(name="isotherm dataset, files of the whole set")
        .remote(spec, uri, orbits, device, allow_outside)
    )
    told["seconds"] = time.monotonic() - began
    told["images_an_hour"] = told["images"] / told["seconds"] * 3600
    text = json.dumps(told, indent=2) + "\n"
    if folder is None:
        _Store(uri).write(_REPORT, text)
    else:
        (folder / _REPORT).write_text(text)
    return told


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m isotherm.dataset", description=__doc__.split("\n", 1)[0])
    parser.add_argument("spec", metavar="SPEC.toml", help="SPEC file, at a path that all machines have")
    parser.add_argument("-o", "--output", metavar="URI", required=True, help="shared folder or object store (fsspec)")
    parser.add_argument("--ray", metavar="ADDRESS", required=True, help="cluster, such as auto; local starts one here")
    parser.add_argument("--device", metavar="NAME", help="as for isotherm dataset")
    parser.add_argument(
        "--gpus", metavar="NUMBER", type=float, default=0.0, help="GPUs of a task (default: %(default)s)"
    )
    parser.add_argument("--retries", metavar="N", type=int, default=8, help="attempts after the first at an orbit")
    parser.add_argument("--allow-outside", action="store_true", help="read files outside the folder of the scene")
    asked = parser.parse_args(arguments)
    try:
        import_module("fsspec")
        ray = import_module("ray")
    except ImportError as error:
        print(f"error: {error}; install isotherm[ray]", file=sys.stderr)
        return 2
    spec = str(Path(asked.spec).absolute())
    options: dict[str, Any] = {
        "device": asked.device,
        "gpus": asked.gpus,
        "retries": asked.retries,
        "allow_outside": asked.allow_outside,
    }
    try:
        told = run(spec, asked.output, asked.ray, **options)
    except IsothermError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except ray.exceptions.RayError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{told['images']} images of {told['orbits']} orbits, {told['orbits_kept']} were there: {asked.output}")
    return 0 if told["complete"] else 1


if __name__ == "__main__":
    sys.exit(main())
