"""Makes a data set in several ways and compares their checksums.

Alone; with sixteen threads of the driver; killed twice and resumed; in three shards; on a Ray cluster that loses a worker.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from . import folder, program
from .spec import copy, number


class Row:
    """A way to make the data set, and what came of it."""

    def __init__(self, name: str, images: int, seconds: float, size: int, memory: int | None, sum_: str) -> None:
        self.name, self.images, self.seconds, self.size, self.memory = name, images, seconds, size, memory
        self.checksum = sum_

    def line(self) -> str:
        """Its line of the table."""
        memory = f"{self.memory / 1e6:.0f} MB" if self.memory else "not measured"
        hourly = 3600 * self.images / self.seconds
        return (
            f"| {self.name} | {self.images:,} | {self.seconds:.0f} | {hourly:,.0f} | {self.size / self.images:,.0f} "
            f"| {memory} | `{self.checksum[:16]}` |"
        )


HEAD = """| way | images | seconds | images an hour | bytes an image | most memory of a process | SHA-256 of `checksums.sha256` |
|---|---|---|---|---|---|---|"""


def arguments() -> argparse.Namespace:
    """What the caller asks for."""
    parser = argparse.ArgumentParser(prog="tools/dataset_same", description=__doc__)
    parser.add_argument("spec", type=Path, help="SPEC file; its scene lies in the same folder")
    parser.add_argument("--samples", type=int, help="in place of that of the SPEC")
    parser.add_argument("--poses-per-orbit", type=int, help="in place of that of the SPEC")
    parser.add_argument("--seed", type=int, default=1, help="of the times of the kills (default: %(default)s)")
    parser.add_argument("--program", type=Path, required=True, help="the built program isotherm")
    parser.add_argument("--no-ray", action="store_true", help="leave out the cluster")
    parser.add_argument("--store", action="store_true", help="also make it on the cluster into an object store")
    parser.add_argument("--page", type=Path, help="replace the section between <!-- same SPEC --> and <!-- /same SPEC -->")
    return parser.parse_args()


def other_seed_shows(asked: argparse.Namespace, spec: Path, orbits: int, work: Path) -> None:
    """Makes the first orbit alone, whose files are those of the whole set, and with another seed, whose files must differ."""
    whole = folder.of_orbit((work / folder.LIST).read_text(), 0)

    def made(used: Path) -> dict[str, str]:
        output = work / "orbit"
        program.alone(asked.program, used, output, "--shard", f"0/{orbits}")
        [found] = output.glob(f"*/*/{folder.LIST}")
        files = folder.of_orbit(found.read_text(), 0)
        shutil.rmtree(output)
        return files

    if made(spec) != whole:
        sys.exit("the first orbit alone has other files than in the whole set")
    other = made(copy(asked.spec, work / "other", {"seed": number(spec, "seed") + 1} | of_asked(asked)))
    equal = sum(1 for name, sum_ in other.items() if whole.get(name) == sum_)
    if equal > len(other) // 10:
        sys.exit(f"with another seed of the SPEC, {equal} of {len(other)} files are the same: the comparison finds nothing")
    print(f"with another seed of the SPEC, {len(other) - equal} of the {len(other)} files of the first orbit differ")


def of_asked(asked: argparse.Namespace) -> dict[str, int | None]:
    """Values that the caller puts in place of those of the SPEC."""
    return {"samples": asked.samples, "poses_per_orbit": asked.poses_per_orbit}


def main() -> None:
    """The command."""
    asked = arguments()
    asked.program = asked.program.absolute()
    Path("target").mkdir(exist_ok=True)
    work = Path(tempfile.mkdtemp(prefix="same-", dir=Path("target"))).absolute()
    spec = copy(asked.spec, work / "spec", of_asked(asked))
    images = number(spec, "samples")
    orbits = -(-images // number(spec, "poses_per_orbit"))
    rows: list[Row] = []

    def way(name: str, make: Callable[[Path], int | None]) -> None:
        print(f"{name} ...", flush=True)
        output = work / "set"
        began = time.monotonic()
        memory = make(output)
        seconds = time.monotonic() - began
        rows.append(Row(name, images, seconds, folder.size(output), memory, folder.check(output)))
        print(rows[-1].line(), flush=True)
        if rows[-1].checksum != rows[0].checksum:
            first = (work / folder.LIST).read_text()
            names = folder.differing(first, (output / folder.LIST).read_text())
            few = ", ".join(names[:5])
            sys.exit(f"{len(names)} files differ from those of the first way, such as {few}; both lists and this set are in {work}")
        shutil.copy(output / folder.LIST, work / folder.LIST)
        # A set may have many gigabytes. Its list is what is compared.
        shutil.rmtree(output)

    way("alone", lambda output: program.alone(asked.program, spec, output))
    # With more threads than cores lavapipe runs workgroups in another order each time.
    way("alone, 16 threads of the driver", lambda output: program.alone(asked.program, spec, output, threads=16))
    way("killed twice and resumed", lambda output: program.killed(asked.program, spec, output, rows[0].seconds, asked.seed))
    way("three shards at once", lambda output: program.shards(asked.program, spec, output, 3))
    if not asked.no_ray:
        from .cluster import Workers

        workers = Workers()
        way("two Ray workers, one killed", lambda output: workers.make_and_lose(spec, output, orbits, asked.seed))
        if asked.store:
            # The name of this protocol is not that of a folder, so files go the way to an object store.
            way("Ray, into an object store", lambda output: workers.make(spec, f"local://{output}"))
        workers.end()
    other_seed_shows(asked, spec, orbits, work)
    shutil.rmtree(work)
    table = "\n".join([HEAD, *(row.line() for row in rows)])
    print(f"\n{table}\n\nok: {len(rows)} folders with equal checksums")
    if asked.page:
        begin, end = f"<!-- same {asked.spec.stem} -->", f"<!-- /same {asked.spec.stem} -->"
        before, rest = asked.page.read_text().split(begin)
        asked.page.write_text(f"{before}{begin}\n{table}\n{end}{rest.split(end)[1]}")


if __name__ == "__main__":
    main()
