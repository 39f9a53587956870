"""One picture a comparison: time against error, or against size."""

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator

from peer_bench.record import Comparison, Row, Spread

OWN, PEERS = "#c8421c", ("#1f6f8b", "#5b8c3a", "#7a5195", "#8a6d1c")
MARKERS = "osD^v"


def plot(comparison: Comparison, folder: Path) -> str | None:
    """Writes the picture; its name, or none where there is nothing to show."""
    if not comparison.rows:
        return None
    makers = {"transition": transition, "columns": columns, "networks": networks, "images": images}
    figure = makers[comparison.key](comparison)
    figure.suptitle(comparison.title, fontsize=13)
    load = comparison.load_average[0][0] if comparison.load_average else float("nan")
    note = f"{comparison.device}; bars from 10 to 90 %; load average {load:.1f} at the start"
    figure.text(0.01, 0.01, note, fontsize=8, color="0.35")
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    name = f"{comparison.key}.png"
    figure.savefig(folder / name, dpi=110)
    plt.close(figure)
    return name


def family(row: Row) -> str:
    """The program without its setting."""
    if row.unit == "ns a node":
        return row.program
    return ", ".join(row.program.split(", ")[: 2 if "whole command" in row.program else 1])


def colours(rows: Iterable[Row]) -> dict[str, str]:
    """Isotherm stands out; peers in the order of their coming."""
    peers = [name for name in dict.fromkeys(family(row) for row in rows) if not name.lower().startswith("isotherm")]
    own = {family(row): OWN for row in rows if family(row).lower().startswith("isotherm")}
    return own | {name: PEERS[number % len(PEERS)] for number, name in enumerate(peers)}


def bars(spread: Spread) -> list[list[float]]:
    return [[max(0.0, spread.median - spread.p10)], [max(0.0, spread.p90 - spread.median)]]


def point(axes: Axes, row: Row, x: Spread, y: float, colour: str, marker: str, label: str | None) -> None:
    fill = "white" if "whole command" in row.program else colour
    style: dict[str, Any] = {"color": colour, "markerfacecolor": fill, "capsize": 3, "markersize": 7}
    axes.errorbar(x.median, y, xerr=bars(x), fmt=marker, label=label, **style)


def finish(axes: Axes, x: str, y: str) -> None:
    axes.set(xscale="log", yscale="log", xlabel=x, ylabel=y)
    for axis in (axes.xaxis, axes.yaxis):
        # Labels at all minor marks of a short axis would run into each other.
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 200.0 * low else (1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(FuncFormatter(lambda *_: ""))
    axes.grid(True, which="both", color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)


def transition(comparison: Comparison) -> plt.Figure:
    """Nanoseconds a node by nodes, a panel a work."""
    works = list(dict.fromkeys(row.work for row in comparison.rows))
    figure, panels = plt.subplots(2, 2, figsize=(12, 9), sharex=True, sharey=True)
    paint = colours(comparison.rows)
    for axes, work in zip(panels.flat, works, strict=False):
        lines = defaultdict(list)
        for row in comparison.rows:
            if row.work == work:
                lines[row.program].append(row)
        for number, (program, rows) in enumerate(lines.items()):
            spreads = [row.times.device or row.times.wall for row in rows]
            error = rows[0].error
            label = f"{program} (rms {error.rms:.1e} K)" if error else program
            sizes = [row.size for row in rows]
            middle = [spread.median for spread in spreads]
            reach = [[max(0.0, s.median - s.p10) for s in spreads], [max(0.0, s.p90 - s.median) for s in spreads]]
            style = {"color": paint[program], "marker": MARKERS[number], "capsize": 3}
            axes.errorbar(sizes, middle, yerr=reach, label=label, **style)
        axes.set_title(work, fontsize=10)
        finish(axes, "nodes", "time of a step [ns a node]")
        axes.legend(fontsize=8)
    return figure


def columns(comparison: Comparison) -> plt.Figure:
    """Error by the time of a turn."""
    figure, axes = plt.subplots(figsize=(9, 6))
    paint = colours(comparison.rows)
    for number, row in enumerate(comparison.rows):
        if row.error:
            label = f"{row.program}: {(row.size or 0) / 1e6:.0f} million node-steps/s"
            point(axes, row, row.times.wall, row.error.rms, paint[family(row)], MARKERS[number], label)
    finish(axes, "time of a turn [ms]", "rms error of all nodes [K]")
    axes.set(xscale="linear", xlim=(0.0, None))
    axes.margins(y=0.3)
    axes.legend()
    return figure


def networks(comparison: Comparison) -> plt.Figure:
    """Error by time, a panel a case."""
    works = list(dict.fromkeys(row.work for row in comparison.rows))
    wide = 2 if len(works) > 1 else 1
    high = (len(works) + wide - 1) // wide
    figure, panels = plt.subplots(high, wide, figsize=(6.5 * wide + 1, 5 * high), squeeze=False)
    paint = colours(comparison.rows)
    for axes in panels.flat[len(works) :]:
        axes.set_visible(False)
    for axes, work in zip(panels.flat, works, strict=False):
        seen: set[str] = set()
        for row in comparison.rows:
            if row.work != work or row.error is None:
                continue
            name = family(row)
            marker = MARKERS[list(paint).index(name) % len(MARKERS)]
            seconds = row.times.wall.scaled(1e-3)
            point(axes, row, seconds, row.error.rms, paint[name], marker, None if name in seen else name)
            setting = row.program.split(", ")[-1]
            place = (seconds.median, row.error.rms)
            below = "whole command" in row.program
            axes.annotate(setting, place, textcoords="offset points", xytext=(6, -11 if below else 6), fontsize=7)
            seen.add(name)
        axes.set_title(work, fontsize=10)
        finish(axes, "time of the solution [s]", "rms error [mK]")
        axes.margins(0.15)
        axes.legend(fontsize=8)
    return figure


def images(comparison: Comparison) -> plt.Figure:
    """Error by time, a panel a scene, a line a program; numbers are samples a pixel."""
    works = list(dict.fromkeys(row.work for row in comparison.rows))
    figure, panels = plt.subplots(1, len(works), figsize=(6 * len(works) + 1, 6), squeeze=False, sharey=True)
    for axes, work in zip(panels.flat, works, strict=True):
        lines = defaultdict(list)
        for row in comparison.rows:
            if row.work == work:
                lines[row.program.rsplit(", ", 1)[0]].append(row)
        peers = iter(PEERS)
        for number, (program, rows) in enumerate(lines.items()):
            colour = OWN if program == "Isotherm" else next(peers)
            times = [row.times.wall for row in rows]
            reach = [[max(0.0, s.median - s.p10) for s in times], [max(0.0, s.p90 - s.median) for s in times]]
            errors = [row.error.rms if row.error else float("nan") for row in rows]
            places = [spread.median for spread in times]
            style = {"color": colour, "marker": MARKERS[number], "capsize": 3}
            axes.errorbar(places, errors, xerr=reach, label=program, **style)
            for row, x, y in zip(rows, places, errors, strict=True):
                axes.annotate(f"{row.size:.0f}", (x, y), textcoords="offset points", xytext=(6, 6), fontsize=8)
        axes.set_title(work, fontsize=10)
        finish(axes, "time of a frame [ms]", "rms error over the mean radiance" if axes is panels.flat[0] else "")
        axes.legend(title="numbers: samples a pixel", fontsize=8)
    return figure
