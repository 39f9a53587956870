"""The package as a whole: stubs, and the examples."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from support import REPOSITORY

import isotherm

PYTHON = REPOSITORY / "python"


def run(*arguments: str, folder: Path = REPOSITORY) -> str:
    ran = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=300, cwd=folder)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return ran.stdout


def test_stubs_agree_with_the_module(tmp_path: Path) -> None:
    run("-m", "mypy.stubtest", "isotherm", folder=tmp_path)


def test_examples_and_tests_have_right_types(tmp_path: Path) -> None:
    cache = f"--cache-dir={tmp_path / 'cache'}"
    run("-m", "mypy", cache, "--strict", "--ignore-missing-imports", "--allow-untyped-calls", str(PYTHON / "examples"))
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import isotherm\nisotherm.Simulation(3).image(position=1)\n")
    ran = subprocess.run([sys.executable, "-m", "mypy", cache, str(wrong)], capture_output=True, text=True, timeout=300)
    assert "Found 2 errors" in ran.stdout, ran.stdout


def test_everything_that_is_named_is_there() -> None:
    assert sorted(isotherm.__all__) == isotherm.__all__
    for name in isotherm.__all__:
        assert hasattr(isotherm, name)
    version = (REPOSITORY / "Cargo.toml").read_text().split('version = "')[1].split('"')[0]
    assert isotherm.__version__ == version


def test_ten_lines() -> None:
    out = run(str(PYTHON / "examples/ten_lines.py"))
    assert out.count("\n") == 5 and "K" in out, out


def test_the_filter_holds_the_craft() -> None:
    out = run(str(PYTHON / "examples/ekf.py"), "--images", "60")
    assert "60 images" in out, out
    error = float(out.split("last position error")[1].split()[0])
    assert error < 0.5, out


def test_images_are_steady_in_memory() -> None:
    out = run(str(PYTHON / "tests/measure.py"), "--images", "300", "--no-program")
    assert "300 images" in out, out
    assert os.environ.get("ISOTHERM_VALIDATION") == "1" or "images/s" in out
