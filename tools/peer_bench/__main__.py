"""Arguments of `tools/peers`, and the order of what it does."""

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from peer_bench import columns, images, networks, page, plots, reflections, transition
from peer_bench.record import Comparison
from peer_bench.workshop import TARGET, Unavailable, Workshop, build_isotherm, tell

PEERS = ("rayon", "pycanha", "radau", "kalast", "mitsuba")
EXAMPLES = """\
Leaves peers.json, peers.md, peers.html and a picture for each comparison in DIR.

Run it on a quiet machine: Isotherm and its peers take turns, so that what else runs slows all of them, but not alike. Times are
stated by the clock and as the time of all processors, which other programs hardly lengthen; the load of the machine is in the
report. The first run builds and downloads everything into target/peers (some minutes, 1 GB); references are kept there.

Examples:
  tools/peers -o out/peers
  tools/peers -o out/peers --quick --only rayon,mitsuba
"""


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="tools/peers",
        description="Measures Isotherm beside its peers on the same work, each with its error beside its time.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="DIR", help="folder for the report")
    parser.add_argument("--only", metavar="PEER,..", help=f"only these of {', '.join(PEERS)}")
    parser.add_argument("--quick", action="store_true", help="fewer cases, sizes and repetitions")
    parser.add_argument("--device", default="llvmpipe", metavar="NAME", help="Vulkan device of Isotherm [llvmpipe]")
    parser.add_argument("--force", action="store_true", help="overwrite an earlier report in DIR")
    given = parser.parse_args()
    given.only = set(given.only.split(",")) if given.only else set(PEERS)
    if unknown := given.only - set(PEERS):
        parser.error(f"--only: there is no '{sorted(unknown)[0]}'; there are {', '.join(PEERS)}")
    if given.output.exists() and not given.output.is_dir():
        parser.error(f"{given.output} is no folder")
    if (given.output / "peers.json").exists() and not given.force:
        parser.error(f"{given.output} has a report already: name another folder, or add --force")
    return given


def comparisons(given: argparse.Namespace, shop: Workshop) -> list[Callable[[], Comparison]]:
    """What is to be measured."""
    wanted: list[tuple[set[str], Callable[[], Comparison]]] = [
        ({"rayon"}, lambda: transition.measure(shop)),
        ({"mitsuba"}, lambda: images.measure(shop)),
        ({"mitsuba"}, lambda: reflections.measure(shop)),
        ({"pycanha", "radau"}, lambda: networks.measure(shop, given.only)),
        ({"kalast"}, lambda: columns.measure(shop)),
    ]
    return [measure for peers, measure in wanted if peers & given.only]


def processor_name() -> str:
    """As Linux has it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(": ")[1] for line in lines if line.startswith("model name")), platform.processor())


def facts(given: argparse.Namespace, shop: Workshop, began: float) -> dict[str, Any]:
    """What holds for all comparisons."""
    return {
        "command": " ".join(["tools/peers", *sys.argv[1:]]),
        "Isotherm": shop.isotherm_version,
        "device asked for": given.device,
        "processor": f"{processor_name()}, {os.cpu_count()} of them",
        "goals go by": "the time of all processors, for the machine is loaded" if shop.loaded else "the clock",
        "when": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "took": f"{time.time() - began:.0f} s, builds included",
    }


def main() -> int:
    given, began = arguments(), time.time()
    given.output.mkdir(parents=True, exist_ok=True)
    work = TARGET / "work"
    work.mkdir(parents=True, exist_ok=True)
    try:
        tell("building Isotherm for release")
        version = build_isotherm()
        loaded = os.getloadavg()[0] > (os.cpu_count() or 1)
        shop = Workshop(given.device, given.quick, work, version, loaded)
    except Unavailable as reason:
        print(f"error: {reason}", file=sys.stderr)
        return 1
    done: list[Comparison] = []
    failed = 0
    for measure in comparisons(given, shop):
        before = os.getloadavg()
        try:
            one = measure()
        except Unavailable as reason:
            print(f"error: {reason}", file=sys.stderr)
            failed += 1
            continue
        one.load_average = [before, os.getloadavg()]
        one.plot = plots.plot(one, given.output)
        done.append(one)
        # After each: what is measured stays if a later one is interrupted.
        page.write(given.output, facts(given, shop, began), done)
    print(page.markdown(facts(given, shop, began), done))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
