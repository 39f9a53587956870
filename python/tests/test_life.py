"""From the first call to the last: with, close, pickle, fork, and the end of the interpreter."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import isotherm


def test_a_closed_simulation_says_so(scene: Path) -> None:
    with isotherm.Simulation(scene, device="cpu") as simulation:
        simulation.step_to(10)
        assert simulation.time == 10
    simulation.close()
    assert simulation.parts and simulation.name
    for call in (lambda: simulation.time, lambda: simulation.step_to(20), simulation.image, simulation.save):
        with pytest.raises(isotherm.RequestError, match="the simulation is closed"):
            call()
    with pytest.raises(ZeroDivisionError), isotherm.Simulation(scene, device="cpu") as simulation:
        _ = 1 / 0
    with pytest.raises(isotherm.RequestError, match="closed"):
        simulation.begin()


def test_cameras_and_frames_are_pickled(scene: Path) -> None:
    camera = isotherm.Camera(64, 48, fx=60, cx=30, distortion=[-0.1, 0.02, 0.001, 0], samples=4, near=0.5)
    camera = camera.replace(exposure_time=0.1, sub_frames=5)
    again = pickle.loads(pickle.dumps(camera))
    names = ("width", "height", "fx", "fy", "cx", "cy", "skew", "distortion", "model", "samples", "near", "line_time")
    names += ("exposure_time", "sub_frames")
    assert again == camera and again != camera.replace(fx=61)
    # A set of cameras has each once, whatever the sign of a 0.
    turned = camera.replace(skew=-0.0)
    assert turned == camera and len({camera, again, turned, camera.replace(fx=61)}) == 2
    assert [getattr(again, name) for name in names] == [getattr(camera, name) for name in names]
    assert (
        pickle.loads(pickle.dumps(camera.replace(distortion=[0.1, 0, 0, 0], distortion_model="fisheye"))).model
        == "fisheye"
    )
    simulation = isotherm.Simulation(scene)
    # The scene's camera has a pose, which its copies have not.
    assert pickle.loads(pickle.dumps(simulation.camera)) == simulation.camera == simulation.camera.replace()
    frame = simulation.image()
    again = pickle.loads(pickle.dumps(frame))
    for name in ("radiance", "temperature", "depth", "part", "material", "coverage", "camera_from_body"):
        assert (
            np.array_equal(getattr(again, name), getattr(frame, name))
            and getattr(again, name).dtype == getattr(frame, name).dtype
        )
    assert (again.time, again.camera.fx, again.error, again.dn) == (frame.time, frame.camera.fx, None, None)
    assert again._repr_png_() == frame._repr_png_()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("device", ["cpu", None])
def test_a_child_of_fork_is_refused_at_once(scene: Path, device: str | None) -> None:
    script = f"""
import os, signal, sys
import isotherm
simulation = isotherm.Simulation({str(scene)!r}, device={device!r})
simulation.step_to(10)
child = os.fork()
if child == 0:
    signal.alarm(20)
    for call in (lambda: simulation.step_to(20), lambda: isotherm.Simulation({str(scene)!r}, device="cpu"), isotherm.devices):
        try:
            call()
        except isotherm.RequestError as error:
            assert "forked" in str(error), error
        else:
            os._exit(3)
    del simulation
    sys.exit(7)
_, status = os.waitpid(child, 0)
assert os.waitstatus_to_exitcode(status) == 7, status
simulation.step_to(20)
"""
    subprocess.run([sys.executable, "-W", "ignore", "-c", script], check=True, timeout=300)


def test_the_interpreter_ends_while_a_thread_steps(scene: Path) -> None:
    script = f"""
import threading, time
import isotherm
simulation = isotherm.Simulation({str(scene)!r}, device="cpu")
simulation.begin()
threading.Thread(target=lambda: simulation.step_to(4e6), daemon=True).start()
time.sleep(1)
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0 and "panick" not in ended.stderr, ended


def test_control_c_ends_a_call_that_waits_for_another_thread(scene: Path) -> None:
    script = f"""
import os, signal, threading, time
import isotherm
simulation = isotherm.Simulation({str(scene)!r}, device="cpu")
simulation.begin()
threading.Thread(target=lambda: simulation.step_to(4e6), daemon=True).start()
time.sleep(0.5)
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
began = time.monotonic()
for call in (lambda: simulation.time, simulation.close, lambda: simulation.joints):
    try:
        call()
    except KeyboardInterrupt:
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    else:
        raise SystemExit("the thread steps for an hour")
assert time.monotonic() - began < 60
time.sleep(0.1)
signal.signal(signal.SIGINT, signal.SIG_IGN)
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0 and "panick" not in ended.stderr, ended


def test_errors_of_calls_are_request_errors(scene: Path) -> None:
    simulation = isotherm.Simulation(scene, device="cpu")
    nan = float("nan")
    for arguments in ({"position": (nan, 0, 3), "look_at": (0, 0, 0)}, {"position": (9, 0, 3), "look_at": (0, nan, 0)}):
        with pytest.raises(isotherm.RequestError, match="must be finite"):
            simulation.image(**arguments)
    with pytest.raises(isotherm.RequestError):
        simulation.step_to(1e30)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
