"""Data sets from Python: shards of one, and what Ray's tasks call."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from support import MODELS

import isotherm
from isotherm import _native, dataset


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    """Four images of two orbits, in a folder with what they need."""
    for name in ("cubesat.toml", "cubesat.glb", "materials.toml"):
        shutil.copy(MODELS / name, tmp_path / name)
    text = (MODELS / "cubesat_dataset.toml").read_text()
    text = text.replace("samples = 1000", "samples = 4").replace("poses_per_orbit = 50", "poses_per_orbit = 2")
    (tmp_path / "spec.toml").write_text(text)
    return tmp_path / "spec.toml"


def test_tasks_make_what_one_process_makes(spec: Path, tmp_path: Path) -> None:
    assert _native.dataset_orbits(spec) == 2
    alone = _native.make_dataset(spec, tmp_path / "alone", device="cpu")
    assert (alone["images"], alone["orbits"], alone["complete"]) == (4, 2, True)
    # What `isotherm dataset` tells of it.
    assert any("no orbit is left for" in warning for warning in alone["warnings"])
    # A folder, and the way to an object store.
    for uri in (str(tmp_path / "folder"), f"local://{tmp_path / 'store'}"):
        for orbit in range(2):
            made = dataset.make_orbit(str(spec), uri, orbit, 2, "cpu", False)
            assert (made["images"], made["orbits"]) == (2, 1)
        assert dataset.finish(str(spec), uri, 2, "cpu", False)
        folder = Path(uri.removeprefix("local://"))
        name = "checksums.sha256"
        assert (folder / name).read_bytes() == (tmp_path / "alone" / name).read_bytes()
        assert not list(folder.glob("report-*"))


def test_an_object_store_takes_no_orbit_of_another_spec(spec: Path, tmp_path: Path) -> None:
    uri = f"local://{tmp_path / 'store'}"
    dataset.make_orbit(str(spec), uri, 0, 2, "cpu", False)
    spec.write_text(spec.read_text().replace("seed = 1", "seed = 2"))
    with pytest.raises(
        isotherm.RequestError, match="^local://.*store holds a data set with another SPEC; name another place"
    ):
        dataset.make_orbit(str(spec), uri, 1, 2, "cpu", False)
    with pytest.raises(
        isotherm.RequestError, match="^local://.*store holds a data set with another SPEC; name another place"
    ):
        dataset.finish(str(spec), uri, 2, "cpu", False)


def test_what_can_not_be_made_is_refused(spec: Path, tmp_path: Path) -> None:
    with pytest.raises(isotherm.RequestError, match="shards count from 0"):
        _native.make_dataset(spec, tmp_path / "out", shard=2, shards=2)
    spec.write_text("sample = 3\n" + spec.read_text())
    with pytest.raises(isotherm.SceneError, match="did you mean 'samples'") as raised:
        _native.dataset_orbits(spec)
    assert (raised.value.file, raised.value.key) == (str(spec), "sample")
