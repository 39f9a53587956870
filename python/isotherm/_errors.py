"""Errors of Isotherm. Each carries file, line and key as far as they are known."""

from __future__ import annotations


class IsothermError(Exception):
    """An error of Isotherm.

    Attributes:
        file: path of the file that it is about, or None
        line: line in that file, from 1, or None
        key: section and key in that file such as ``time.step``, or None
    """

    def __init__(self, message: str, file: str | None = None, line: int | None = None, key: str | None = None) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.key = key

    def __reduce__(self) -> tuple[type[IsothermError], tuple[str, str | None, int | None, str | None]]:
        return type(self), (self.args[0], self.file, self.line, self.key)


class SceneError(IsothermError, ValueError):
    """A scene that can not be used: a key, a value, a model, or a file that is missing."""


class RequestError(IsothermError, ValueError):
    """A call that can not be answered: a time, a pose, a camera, a place, a joint or a state."""


class DeviceError(IsothermError, RuntimeError):
    """A device that can not be used, or a call of it that failed."""
