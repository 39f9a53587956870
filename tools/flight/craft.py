"""The model and the scene of Delfi-PQ, and its runs."""

import csv
import runpy
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy

HALF = (0.025, 0.025, 0.089)  # Half the sides of the craft [m].
NAMES = {(0, 1): "side_xp", (0, -1): "side_xm", (1, 1): "side_yp", (1, -1): "side_ym"}
STEP = 60.0  # [s]

# Values before any fit, each with a range of 95 % where it is uncertain.
HANDBOOK = {
    "absorptivity": 0.88,
    "emissivity": 0.80,
    "panel": 3256.0,
    "inner": 10600.0,
    "coupling": 0.67,
}


@dataclass
class Run:
    """A day of a run: times [s], mean of the side panels and its uncertainty [K]."""

    times: numpy.ndarray
    panels: numpy.ndarray
    sigma: numpy.ndarray


def mesh():
    """The bytes of the model: a box whose faces are parts, made by the writer of tools/cubesat."""
    cubesat = runpy.run_path(str(Path(__file__).parent.parent / "cubesat"))
    nodes = []
    for axis in range(3):
        for sign in (-1, 1):
            whole = cubesat["Mesh"]()
            whole.box(HALF, (0, 0, 0), lambda a, s: "panel")
            face = cubesat["Mesh"]()
            # Corners of a face of the box follow each other.
            place = 4 * (2 * axis + (sign > 0))
            face.corners = whole.corners[place : place + 4]
            face.normals = whole.normals[place : place + 4]
            face.triangles = {"panel": [0, 1, 2, 0, 2, 3]}
            name = NAMES.get((axis, sign), "end_zp" if sign > 0 else "end_zm")
            nodes.append((name, (0, 0, 0), face, []))
    return cubesat["write"](nodes)


def scene(day, values, uncertain):
    """The text of a scene for a day of samples."""
    asks = ""
    if uncertain:
        parameters = (
            'vary = "absorptivity"\nmaterial = "panel"\nrange = [0.76, 0.92]',
            'vary = "emissivity"\nmaterial = "panel"\nrange = [0.76, 0.88]',
            'vary = "capacity"\nmaterial = "panel"\npercent = 30',
            'vary = "albedo"\nrange = [0.2, 0.4]',
            'vary = "planet_ir"\nrange = [210, 260]',
        )
        asks = "[uncertainty]\n" + "".join(
            f"[[uncertainty.parameter]]\n{one}\n" for one in parameters
        )
    inner = values["inner"] / 1000
    return f"""name = "Delfi-PQ"
[model]
path = "delfi_pq.glb"
[time]
start = "{day.start:%Y-%m-%dT%H:%M:%SZ}"
step = {STEP}
steps = {int(86400 / STEP)}
warm_up_orbits = 4
draw_every = 0
[orbit]
file = "elements.tle"
[attitude]
mode = "tumble"
[environment]
solar_constant = 1361.0
albedo = 0.3
planet_ir = 237.0
planet_radius = 6371e3
eclipse = true
background_temperature = 2.7
[[material]]
match = "panel"
absorptivity = {values["absorptivity"]}
emissivity = {values["emissivity"]}
heat_capacity_per_area = {values["panel"]}
over = {{ effective_emittance = {values["coupling"]}, thickness = 0.001, density = 1000, specific_heat = {1000 * inner}, conductivity = 0 }}
response = "radiative"
{asks}"""


class Program:
    """Runs of the program in a folder, by the day and the values."""

    def __init__(self, program, folder):
        self.program, self.folder = str(Path(program).resolve()), folder
        self.count = 0
        (folder / "delfi_pq.glb").write_bytes(mesh())

    def call(self, *arguments):
        done = subprocess.run(
            [self.program, *arguments], cwd=self.folder, capture_output=True, text=True
        )
        if done.returncode:
            raise SystemExit(f"validation: {done.stderr.strip()}")

    def write(self, day, values, uncertain=False):
        (self.folder / "elements.tle").write_text("\n".join(day.elements) + "\n")
        (self.folder / "scene.toml").write_text(scene(day, values, uncertain))

    def run(self, day, values, uncertain=False):
        """The side panels over a day."""
        self.write(day, values, uncertain)
        self.call("run", "scene.toml", "-o", "run", "--force", "--device", "cpu", "--save-every", "0")
        self.count += 1
        with (self.folder / "run/series.csv").open() as file:
            rows = list(csv.DictReader(file))
        sides = list(NAMES.values())
        column = lambda what: numpy.array(
            [[float(row[f"part:{name}:{what}"]) for name in sides] for row in rows]
        ).mean(axis=1)
        times = numpy.array([float(row["time"]) for row in rows])
        sigma = column("sigma") if uncertain else numpy.zeros(len(rows))
        return Run(times, column("mean"), sigma)

    def umbras(self, day):
        """Times at which umbra begins and ends in a day [s]."""
        self.write(day, HANDBOOK)
        self.call("environment", "scene.toml", "-o", "env.csv")
        with (self.folder / "env.events.csv").open() as file:
            events = [row for row in csv.DictReader(file) if row["boundary"] == "umbra"]
        of = lambda kind: [float(row["time_s"]) for row in events if row["event"] == kind]
        entries, exits = of("entry"), of("exit")
        if exits and (not entries or exits[0] < entries[0]):
            entries.insert(0, exits[0] - 2100.0)
        if len(exits) < len(entries):
            exits.append(entries[-1] + 2100.0)
        return list(zip(entries, exits))
