"""Data sets made by processes of ``isotherm dataset``: alone, killed twice and resumed, and in shards."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from . import folder


class Process:
    """A process of ``isotherm dataset``."""

    def __init__(self, program: Path, spec: Path, output: Path, *options: str, threads: int | None = None) -> None:
        command = [program, "dataset", spec, "-o", output, "--allow-outside", *options]
        self._log = output.with_suffix(f".{time.monotonic_ns()}.log")
        with self._log.open("w") as log:
            driver = {"LP_NUM_THREADS": str(threads)} if threads else {}
            self._process = subprocess.Popen(command, stdout=log, stderr=log, env=os.environ | driver)

    def kill_after(self, seconds: float) -> None:
        """Sends SIGKILL after so many seconds, in a thread of its own."""
        threading.Timer(seconds, os.kill, (self._process.pid, signal.SIGKILL)).start()

    def wait(self, status: int = 0) -> int:
        """Waits for its end with this status. Returns its greatest memory in bytes."""
        _, found, used = os.wait4(self._process.pid, 0)
        self._process.returncode = os.waitstatus_to_exitcode(found)
        if self._process.returncode != status:
            sys.exit(f"isotherm dataset ended with {self._process.returncode}, not {status}:\n{self._log.read_text()}")
        return used.ru_maxrss * 1024


def alone(program: Path, spec: Path, output: Path, *options: str, threads: int | None = None) -> int:
    """One process. Returns its greatest memory in bytes, like all functions of this file. lavapipe starts so many ``threads``."""
    return Process(program, spec, output, *options, threads=threads).wait()


def killed(program: Path, spec: Path, output: Path, seconds: float, seed: int) -> int:
    """One process after the other. The first two are killed at random times, of which ``seconds`` is the time of an undisturbed run."""
    times = random.Random(seed)
    most = 0
    # Together at most 0.85 of the undisturbed time, so neither comes too late.
    for least, greatest in ((0.1, 0.5), (0.1, 0.35)):
        after = times.uniform(least * seconds, greatest * seconds)
        process = Process(program, spec, output, "--resume")
        process.kill_after(after)
        most = max(most, process.wait(-signal.SIGKILL))
        print(f"  SIGKILL after {after:.1f} s, {folder.orbits(output)} orbits are whole", flush=True)
    return max(most, alone(program, spec, output, "--resume"))


def shards(program: Path, spec: Path, output: Path, count: int) -> int:
    """So many processes at once, each with its shard."""
    processes = [Process(program, spec, output, "--shard", f"{index}/{count}") for index in range(count)]
    return max(process.wait() for process in processes)
