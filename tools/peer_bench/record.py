"""What was measured, as plain values: `peers.json`."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Spread:
    """Median, the range from the tenth to the ninetieth percentile, and the least."""

    median: float
    p10: float
    p90: float
    least: float
    samples: int

    @classmethod
    def of(cls, values: Sequence[float]) -> "Spread":
        low, middle, high = np.percentile(np.asarray(values, dtype=float), [10, 50, 90])
        return cls(float(middle), float(low), float(high), float(min(values)), len(values))

    def scaled(self, factor: float) -> "Spread":
        return Spread(
            median=self.median * factor,
            p10=self.p10 * factor,
            p90=self.p90 * factor,
            least=self.least * factor,
            samples=self.samples,
        )


@dataclass(frozen=True)
class Times:
    """By the clock, of all processors together, and by the device's own clock where there is one."""

    wall: Spread
    processor: Spread | None = None
    device: Spread | None = None

    @classmethod
    def of(cls, clocks: Sequence[Sequence[float]], device: Sequence[float] | None = None) -> "Times":
        """Of pairs of clock and processor, and times of the device."""
        wall, busy = zip(*clocks, strict=True)
        return cls(Spread.of(wall), Spread.of(busy), None if not device else Spread.of(device))

    def scaled(self, factor: float) -> "Times":
        def one(spread: Spread | None) -> Spread | None:
            return None if spread is None else spread.scaled(factor)

        return Times(self.wall.scaled(factor), one(self.processor), one(self.device))


@dataclass(frozen=True)
class Error:
    """Root mean square and largest difference."""

    rms: float
    largest: float
    unit: str


@dataclass(frozen=True)
class Row:
    """One program on one work; `times` are in `unit`."""

    work: str
    program: str
    version: str
    times: Times
    unit: str
    error: Error | None
    # Time over Isotherm's on the same work: above 1 Isotherm is the faster. By the clock, and of the processors.
    ratio: float | None = None
    ratio_processor: float | None = None
    note: str = ""
    # For plots: the abscissa of a work that grows, such as nodes, or samples a pixel.
    size: float | None = None


@dataclass(frozen=True)
class Goal:
    """What was to be reached, and whether it was."""

    text: str
    measured: str
    met: bool
    reason: str = ""


@dataclass
class Comparison:
    """One kind of work."""

    key: str
    title: str
    about: str
    reference: str = ""
    rows: list[Row] = field(default_factory=list)
    goals: list[Goal] = field(default_factory=list)
    # What could not run, and why.
    missing: list[str] = field(default_factory=list)
    plot: str | None = None
    # Load averages of the machine over 1, 5 and 15 minutes before and after.
    load_average: list[tuple[float, float, float]] = field(default_factory=list)
    device: str = ""
