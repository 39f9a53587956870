"""A case: a scene that is made, a stored truth, and the bounds that the program is held to."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

SIGMA = 5.670374419e-8


@dataclass
class Bounds:
    """Largest differences from the truth [K]. `None`: not bounded."""

    rms: float | None = None
    p99: float | None = None
    largest: float | None = None


@dataclass
class Case:
    """One scene held against one truth."""

    name: str
    # Writes the scene into a folder; gives its path. Needs numpy alone.
    build: Callable[[Path], Path]
    # Makes the truth: rows of step, u, v, part, kelvin. Needs Embree and scipy.
    truth: Callable[[], list[tuple[int, int, int, int, float]]]
    bounds: Bounds
    # Table of the truth; cases with several meshes share one.
    data: str = ""
    # Steps of the table in one of its own.
    table_steps: int = 1
    # Whether it runs only with --long.
    long: bool = False
    # Names of the parts that the truth numbers.
    parts: list[str] = field(default_factory=list)
    # What the case is there to find.
    finds: str = ""

    def table(self) -> str:
        return self.data or self.name
