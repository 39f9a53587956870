"""Threads, and Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from support import Scenes

import isotherm

LONG = 4.0e6  # Seconds of simulated time that no test waits for.


def images(scene: Path, device: str | None = None) -> list[bytes]:
    simulation = isotherm.Simulation(scene, device=device)
    seen = []
    for step in range(8):
        simulation.step_to(25.0 * step)
        seen.append(simulation.image().radiance.tobytes())
    return seen


def test_simulations_in_threads_are_those_of_one_thread(scenes: Scenes) -> None:
    one = scenes.write()
    other = scenes.write(("beta_deg = 20", "beta_deg = 50"), name="other.toml")
    alone = [images(one), images(other)]
    assert alone[0] != alone[1]
    with ThreadPoolExecutor(4) as threads:
        assert list(threads.map(images, [one, other, one, other])) == alone * 2


def test_one_simulation_from_several_threads(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    expected = simulation.image().radiance.tobytes()
    with ThreadPoolExecutor(4) as threads:
        seen = list(threads.map(lambda _: simulation.image().radiance.tobytes(), range(20)))
    assert set(seen) == {expected}


def test_the_interpreter_is_free_while_the_device_works(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    began = threading.Event()
    ended = threading.Event()
    counted = 0

    def step() -> None:
        began.set()
        simulation.step_to(2.0e4)
        ended.set()

    worker = threading.Thread(target=step)
    worker.start()
    began.wait()
    while not ended.is_set():
        counted += 1
        time.sleep(0)
    worker.join()
    assert simulation.time == 2.0e4
    assert counted > 10, "this thread went on"


def test_ctrl_c_ends_steps_and_the_simulation_goes_on(scene: Path) -> None:
    script = f"""
import isotherm
simulation = isotherm.Simulation({str(scene)!r})
simulation.step_to(30)
print("ready", flush=True)
try:
    simulation.step_to({LONG})
except KeyboardInterrupt:
    print("interrupted", 30 <= simulation.time < {LONG}, flush=True)
reached = simulation.time
saved = simulation.save()
simulation.step_to(reached + 20)
there = simulation.node_temperatures().tobytes()
simulation.restore(saved)
simulation.step_to(reached + 20)
print("on", simulation.node_temperatures().tobytes() == there, flush=True)
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=300)
    assert out == "interrupted True\non True\n" and process.returncode == 0


def test_ctrl_c_ends_loading_and_an_image(scene: Path) -> None:
    many_rays = scene.read_text() + "\n[exchange]\npatch_edge = 0.02\nrays = 60000\n"
    slow = scene.with_name("slow.toml")
    slow.write_text(many_rays)
    script = f"""
import isotherm, signal
def stopped(work):
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        work()
    except KeyboardInterrupt:
        return True
    return False
signal.signal(signal.SIGALRM, signal.default_int_handler)
print(stopped(lambda: isotherm.Simulation({str(slow)!r}, device="cpu")))
simulation = isotherm.Simulation({str(scene)!r}, device="cpu")
camera = isotherm.Camera(2000, 2000, fx=2000, samples=16)
pose = dict(position=[10, 10, 10], look_at=[0, 0, 0])
print(stopped(lambda: simulation.image(camera=camera, **pose)))
simulation.step_to(30)
print(simulation.time)
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300)
    assert ran.stdout == "True\nTrue\n30.0\n", ran.stderr


def test_a_handler_that_calls_the_simulation_is_refused(scene: Path) -> None:
    script = f"""
import isotherm, signal
simulation = isotherm.Simulation({str(scene)!r})
signal.signal(signal.SIGALRM, lambda *_: simulation.save())
signal.setitimer(signal.ITIMER_REAL, 0.3)
try:
    simulation.step_to({LONG})
except isotherm.RequestError as error:
    print(error)
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300)
    assert ran.stdout == "this thread is at work with the simulation already\n", ran.stderr
