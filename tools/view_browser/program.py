"""Starts `isotherm view` on a free port, and ends it."""

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def view(scene: str, *arguments: str) -> Iterator[str]:
    """The address of the page of a scene."""
    command = [os.environ["ISOTHERM"], "view", scene, "--no-browser", *arguments]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert program.stdout is not None and program.stderr is not None
    try:
        address = program.stdout.readline().strip()
        if not address.startswith("http://127.0.0.1:"):
            raise SystemExit(f"isotherm view gave no address: {program.stderr.read()}")
        yield address
        assert program.poll() is None, "the program has ended by itself"
        program.send_signal(signal.SIGTERM)
        assert program.wait(60) == 0, "the program does not end in order"
    finally:
        program.kill()
        program.wait()
