"""What all tests are given."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from support import Scenes

import isotherm

# A shell that runs the tests in the background ignores Ctrl-C, and programs that it starts inherit this.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def scenes(tmp_path: Path) -> Scenes:
    return Scenes(tmp_path)


@pytest.fixture
def scene(scenes: Scenes) -> Path:
    return scenes.write()


@pytest.fixture(scope="session", autouse=True)
def _silent_device(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The validation layer, where it is on, says nothing in all tests."""
    kept = isotherm.Simulation(Scenes(tmp_path_factory.mktemp("kept")).write())
    yield
    assert isotherm.validation_messages() == []
    del kept
