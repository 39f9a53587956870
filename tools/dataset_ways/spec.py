"""Copies of a SPEC with other values of the root."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path


def copy(spec: Path, folder: Path, changed: dict[str, int | str | None]) -> Path:
    """Copies the SPEC with all that lies beside it, and puts values in place of its own. ``None`` keeps one."""
    shutil.copytree(spec.parent, folder)
    text = (folder / spec.name).read_text()
    for key, value in changed.items():
        if value is None:
            continue
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        if count != 1:
            sys.exit(f"{spec} has no line '{key} = ...'")
    (folder / spec.name).write_text(text)
    return (folder / spec.name).absolute()


def number(spec: Path, key: str) -> int:
    """A whole number of the root. The default of a seed is 0."""
    found = re.search(rf"(?m)^{key} = (\d+)", spec.read_text())
    return int(found[1]) if found else 0
