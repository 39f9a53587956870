"""What ``pickle`` calls to make objects again."""

from __future__ import annotations

from typing import Any

from ._native import Frame


def frame(state: dict[str, Any]) -> Frame:
    return Frame._restored(state)
