"""Runs the public scripts of SurRender, as they are, and prints a table.

python scripts.py ISOTHERM HOME: HOME has the folders `scenarios` and `client`.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

# The fifteen: every script, and the tests that are no copy of a script.
SCRIPTS = [
    "script_00_installation_control.py",
    "script_01_rendering_a_sphere.py",
    "script_02_simple_earth_sun_camera_system.py",
    "script_03_summer_solstice.py",
    "script_04_raytracing_precision.py",
    "script_05_psf.py",
    "script_06_tycho_background.py",
    "script_07_stellar_background.py",
    "script_08_itokawa_mesh.py",
    "script_09_ceres_landing.py",
    "script_10_itokawa_SPICE.py",
    "demo_fullmoon.py",
    "test_11_look_at_star.py",
    "test_12_test_record.py",
    "test_13_test_stdthreshold.py",
]
MOST_SECONDS = 120


def reason(text: str) -> str:
    """The last line that says why a script ended."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    told = [line for line in lines if "[error]" in line] or [line for line in lines if "Error" in line or "xception" in line] or lines
    return told[-1][:160].replace("|", "/") if told else "it says nothing"


def main() -> None:
    isotherm, home = os.path.abspath(sys.argv[1]), Path(sys.argv[2]).absolute()
    root = Path(__file__).resolve().parents[2]
    work = home / "scripts_work"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(home / "scenarios", work, ignore=shutil.ignore_patterns(".git"))
    models = root / "models"
    scenes = [str(models / "sphere.toml"), f"itokawa_f3145728.obj={models / 'cubesat.toml'}"]
    server = subprocess.Popen([isotherm, "serve", *scenes, "--protocol", "surrender"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    environment = {**os.environ, "PYTHONPATH": str(home / "client"), "MPLBACKEND": "Agg"}
    good = 0
    try:
        assert server.stdout.readline().startswith("listening on "), "the server does not start: is the port 5151 free?"
        print("| script | runs unchanged | why not, or what it wrote |\n|---|---|---|")
        for name in SCRIPTS:
            before = set(work.iterdir())
            try:
                done = subprocess.run(
                    [sys.executable, name], cwd=work, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=MOST_SECONDS
                )
                right, told = done.returncode == 0 and "[error]" not in done.stdout + done.stderr, reason(done.stdout + done.stderr)
            except subprocess.TimeoutExpired:
                right, told = False, f"not done after {MOST_SECONDS} s"
            written = sorted(path.name for path in set(work.iterdir()) - before)
            good += right
            print(f"| `{name}` | {'yes' if right else 'no'} | {', '.join(written) or 'no file' if right else told} |", flush=True)
        print(f"\n{good} of {len(SCRIPTS)} run unchanged.")
    finally:
        server.terminate()
        server.wait(60)


main()
