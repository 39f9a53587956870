"""Where programs are built and run: paths, versions, commands with a time limit."""

import importlib.metadata
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from peer_bench.record import Times

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / "target" / "peers"
# Seconds: a build of all of Isotherm on two busy cores; a run.
BUILD_LIMIT, RUN_LIMIT = 3600.0, 1800.0
LLVM_PACKAGE = "libllvm19"


class Unavailable(Exception):
    """Something could not be built or run; the text says why."""


def tell(text: str) -> None:
    """A line on standard error."""
    print(f"peers: {text}", file=sys.stderr, flush=True)


def run(command: Sequence[str | Path], limit: float, **options: Any) -> str:
    """The standard output of a command."""
    words = [str(word) for word in command]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=limit, check=False, **options)
    except subprocess.TimeoutExpired as late:
        raise Unavailable(f"`{' '.join(words[:4])} ...` did not end within {limit:.0f} s") from late
    except OSError as error:
        raise Unavailable(f"`{words[0]}` could not be run: {error.strerror}") from error
    if done.returncode != 0:
        last = (done.stderr.strip() or done.stdout.strip() or "it said nothing").splitlines()[-1]
        raise Unavailable(f"`{' '.join(words[:4])} ...` ended with {done.returncode}: {last}")
    return done.stdout


@dataclass(frozen=True)
class Workshop:
    """What the measurements have in common."""

    device: str
    quick: bool
    work: Path
    isotherm_version: str
    # Whether more programs wanted to run at the start than there are processors.
    loaded: bool

    def judged(self, times: Times) -> float:
        """What goals go by: the clock's median, or on a loaded machine that of the processors, which others hardly change."""
        return times.processor.median if self.loaded and times.processor else times.wall.median

    def isotherm(self, *arguments: str | Path, limit: float = RUN_LIMIT) -> dict[str, Any]:
        """What Isotherm's half of the measurements says (`tools/src/peers`)."""
        program = ROOT / "target" / "release" / "peers"
        return json.loads(run([program, "--device", self.device, *arguments], limit))

    def command_line(self, *arguments: str | Path) -> str:
        """Runs `isotherm` itself."""
        return run([ROOT / "target" / "release" / "isotherm", *arguments, "--device", self.device], RUN_LIMIT)

    def python(self, module: str, *arguments: str | Path, limit: float = RUN_LIMIT) -> None:
        """Runs a module of this package in a process of its own."""
        environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
        run([sys.executable, "-m", f"peer_bench.{module}", *arguments], limit, env=environment)


def build_isotherm() -> str:
    """Builds Isotherm and its half of the measurements for release; its version."""
    command = ["cargo", "build", "--release", "-q", "-p", "isotherm", "-p", "isotherm-tools"]
    run([*command, "--bin", "isotherm", "--bin", "peers"], BUILD_LIMIT, cwd=ROOT)
    return run([ROOT / "target" / "release" / "isotherm", "--version"], RUN_LIMIT).split()[-1]


def build_kalast() -> Path:
    """Builds the program around kalast, which is a cargo workspace of its own."""
    folder = ROOT / "tools" / "peer_bench" / "kalast"
    environment = os.environ | {"CARGO_TARGET_DIR": str(TARGET / "cargo")}
    run(["cargo", "build", "--release", "-q", "--locked"], BUILD_LIMIT, cwd=folder, env=environment)
    return TARGET / "cargo" / "release" / "peer-kalast"


def version(package: str) -> str:
    """Version of a Python package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError as missing:
        raise Unavailable(f"the Python package {package} is not installed") from missing


def locked_version(lock: Path, package: str) -> str:
    """Version of a crate in a Cargo.lock."""
    lines = lock.read_text(encoding="utf-8").splitlines()
    at = lines.index(f'name = "{package}"')
    return lines[at + 1].split('"')[1]


def llvm() -> Path:
    """The LLVM that Mitsuba's just-in-time compiler loads, unpacked from Debian's package and not installed; the 15 that
    Mesa brings along fails on its code."""
    folder = TARGET / "llvm"
    if not (found := list(folder.glob("usr/lib/*/libLLVM.so.19*"))):
        if shutil.which("apt-get") is None or shutil.which("dpkg-deb") is None:
            raise Unavailable(f"no apt-get and dpkg-deb to fetch {LLVM_PACKAGE} with")
        folder.mkdir(parents=True, exist_ok=True)
        run(["apt-get", "download", "-q", LLVM_PACKAGE], RUN_LIMIT, cwd=folder)
        package = next(folder.glob("*.deb"))
        run(["dpkg-deb", "--extract", package, folder], RUN_LIMIT)
        package.unlink()
        found = list(folder.glob("usr/lib/*/libLLVM.so.19*"))
    if not found:
        raise Unavailable(f"{LLVM_PACKAGE} holds no libLLVM.so.19")
    return found[0]
