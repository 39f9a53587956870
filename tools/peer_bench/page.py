"""What was measured as files: `peers.json`, `peers.md` and `peers.html`."""

import html
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from peer_bench.record import Comparison, Error, Row, Spread

HEAD = (
    "work",
    "program",
    "version",
    "device",
    "clock",
    "processors",
    "error rms",
    "largest",
    "peer / Isotherm",
    "note",
)
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1200px; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; font-size: 13px; margin: 1em 0 } td, th { border: 1px solid #ccc; padding: 3px 7px }
th { background: #f3f3f3; text-align: left } img { max-width: 100% } .met { color: #2b7a2b } .missed { color: #b02a1a }
"""


def digits(value: float) -> str:
    """Three significant digits."""
    return f"{value:.3g}" if 1e-3 <= abs(value) < 1e4 or value == 0.0 else f"{value:.2e}"


def spread(value: Spread | None, unit: str) -> str:
    if value is None:
        return ""
    reach = f"{digits(value.p10)} to {digits(value.p90)}, least {digits(value.least)}"
    return f"{digits(value.median)} ({reach}) {unit}"


def size_of(error: Error | None, which: str) -> str:
    return f"{digits(getattr(error, which))} {error.unit}" if error else ""


def ratio(row: Row) -> str:
    if row.ratio is None:
        return ""
    busy = f"; {digits(row.ratio_processor)} processors" if row.ratio_processor is not None else ""
    return digits(row.ratio) + busy


def cells(row: Row) -> list[str]:
    """A line of the table."""
    size = f", {row.size:.0e} nodes" if row.unit == "ns a node" and row.size else ""
    times = row.times
    return [
        row.work + size,
        row.program,
        row.version,
        spread(times.device, row.unit),
        spread(times.wall, row.unit),
        spread(times.processor, row.unit),
        size_of(row.error, "rms"),
        size_of(row.error, "largest"),
        ratio(row),
        row.note,
    ]


def loads(comparison: Comparison) -> str:
    each = [" ".join(f"{value:.1f}" for value in load) for load in comparison.load_average]
    return " before, ".join(each) + " after" if len(each) == 2 else ", ".join(each)


def markdown(facts: dict[str, Any], comparisons: list[Comparison]) -> str:
    """The page for a terminal or a repository."""
    lines = ["# Isotherm and its peers", "", *(f"- {name}: {value}" for name, value in facts.items())]
    for one in comparisons:
        lines += ["", f"## {one.title}", "", one.about, "", f"Errors are against: {one.reference}.", ""]
        lines += [f"Device: {one.device}; load averages (1, 5, 15 minutes): {loads(one)}.", ""]
        for goal in one.goals:
            verdict = "met" if goal.met else "missed"
            reason = f" ({goal.reason})" if goal.reason else ""
            lines.append(f"- **{verdict}**: {goal.text}: {goal.measured}{reason}")
        lines += [f"- could not run: {text}" for text in one.missing]
        lines += ["", "| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
        lines += ["| " + " | ".join(cells(row)) + " |" for row in one.rows]
        if one.plot:
            lines += ["", f"![{one.title}]({one.plot})"]
    return "\n".join(lines) + "\n"


def page(facts: dict[str, Any], comparisons: list[Comparison]) -> str:
    """The same as one page for a browser."""
    parts = [f"<!doctype html><meta charset=utf-8><title>Isotherm and its peers</title><style>{STYLE}</style>"]
    parts.append("<h1>Isotherm and its peers</h1><ul>")
    parts += [f"<li>{html.escape(name)}: {html.escape(str(value))}" for name, value in facts.items()]
    parts.append("</ul>")
    for one in comparisons:
        parts.append(f"<h2>{html.escape(one.title)}</h2><p>{html.escape(one.about)}")
        parts.append(f"<p>Errors are against: {html.escape(one.reference)}.")
        parts.append(f"<p>Device: {html.escape(one.device)}; load averages (1, 5, 15 minutes): {loads(one)}.<ul>")
        for goal in one.goals:
            verdict = "met" if goal.met else "missed"
            reason = f" ({goal.reason})" if goal.reason else ""
            text = html.escape(f"{goal.text}: {goal.measured}{reason}")
            parts.append(f"<li><b class={verdict}>{verdict}</b>: {text}")
        parts += [f"<li>could not run: {html.escape(text)}" for text in one.missing]
        if one.plot:
            parts.append(f'</ul><p><img src="{one.plot}" alt="{html.escape(one.title)}">')
        parts.append("<table><tr>" + "".join(f"<th>{name}" for name in HEAD))
        parts += ["<tr>" + "".join(f"<td>{html.escape(cell)}" for cell in cells(row)) for row in one.rows]
        parts.append("</table>")
    return "\n".join(parts) + "\n"


def write(folder: Path, facts: dict[str, Any], comparisons: list[Comparison]) -> None:
    """All three, each whole or not at all."""
    record = {"facts": facts, "comparisons": [asdict(one) for one in comparisons]}
    for name, text in (
        ("peers.json", json.dumps(record, indent=1, allow_nan=True) + "\n"),
        ("peers.md", markdown(facts, comparisons)),
        ("peers.html", page(facts, comparisons)),
    ):
        beside = folder / f".{name}.part"
        beside.write_text(text, encoding="utf-8")
        beside.replace(folder / name)
