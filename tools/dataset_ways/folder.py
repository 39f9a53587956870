"""A finished data set: its checksums and its size."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

LIST = "checksums.sha256"


def check(folder: Path) -> str:
    """The checksum of the list of checksums, after all files agree with the list."""
    found = (folder / LIST).read_bytes()
    for line in found.decode().splitlines():
        expected, name = line.split("  ", 1)
        with (folder / name).open("rb") as file:
            if hashlib.file_digest(file, "sha256").hexdigest() != expected:
                sys.exit(f"{folder / name} is not what the list says")
    return hashlib.sha256(found).hexdigest()


def size(folder: Path) -> int:
    """Bytes of all its files."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def orbits(folder: Path) -> int:
    """Number of its orbits that are whole."""
    return sum(1 for _ in folder.glob(f"*/*/{LIST}"))


def of_orbit(sums: str, orbit: int) -> dict[str, str]:
    """The checksums of an orbit's files in a list, by their paths in the folder of the orbit, whichever split it belongs to."""
    lines = [line.split("  ", 1) for line in sums.splitlines()]
    places = [(name.split("/", 2), sum_) for sum_, name in lines]
    return {place[2]: sum_ for place, sum_ in places if len(place) == 3 and place[1] == f"{orbit:06}"}


def differing(sums: str, other: str) -> list[str]:
    """The names that two lists of checksums give otherwise, or that only one of them has."""
    lines = set(sums.splitlines()) ^ set(other.splitlines())
    return sorted({line.split("  ", 1)[1] for line in lines})
