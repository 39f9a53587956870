"""Eleven parts of the station through one orbit, with an eclipse and all loads: a network with conduction, shadows and radiation between surfaces."""

import tomllib
from pathlib import Path

import numpy as np

from .. import gltf
from ..camera import Camera
from ..case import Bounds, Case

MODELS = Path(__file__).resolve().parents[3] / "models"
# Modules and a radiator that stand close. Without the truss: shadows of its lattice on thin blankets are finer than any mesh of these cases.
NAMES = [
    "adapter_forward", "node_forward", "laboratory_central", "node_central", "laboratory_starboard", "laboratory_port", "logistics_module", "airlock", "node_port", "cupola",
    "radiator_centre",
]  # fmt: skip
ALTITUDE, RADIUS, BETA_DEG, STEP, STEPS, EVERY, INITIAL, ALBEDO, PLANET = 408e3, 6371e3, 20.0, 15.43, 360, 36, 265.0, 0.3, 237.0
# The material without conduction: heat spreads by 3 mm before it is radiated.
FOIL = "mli_blanket"
CAMERA = Camera((36.0, 22.0, -24.0), (3.5, -1.0, 0.5), 36.0, 320, 240, (0.0, 0.0, -1.0))


def parts() -> list[gltf.Part]:
    """The eleven, as the station's file has them."""
    return [part for part in gltf.read(MODELS / "station.glb") if part.name in NAMES]


def _materials() -> str:
    text = (MODELS / "station.toml").read_text()
    return text[text.index("[[material]]") : text.index("[radiance]")]


def _build(max_edge: float, exchange: str):
    def build(folder: Path) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        gltf.write(folder / "model.glb", parts())
        text = f"""name = "station_cut"
[model]
path = "model.glb"
max_edge = {max_edge}
[time]
step = {STEP}
steps = {STEPS}
draw_every = {EVERY}
[initial]
temperature = {INITIAL}
[orbit]
altitude = {ALTITUDE}
beta_deg = {BETA_DEG}
[attitude]
mode = "nadir"
nadir_axis = "+Z"
forward_axis = "+X"
[environment]
solar_constant = 1361.0
albedo = {ALBEDO}
planet_ir = {PLANET}
planet_radius = {RADIUS}
background_temperature = 2.7
[shadows]
{exchange}
{CAMERA.toml()}
{_materials()}"""
        path = folder / "scene.toml"
        path.write_text(text)
        return path

    return build


def _finishes() -> dict:
    from ..balance import Finish

    def stored(of: dict) -> float:
        return of["thickness"] * of["density"] * of["specific_heat"]

    found = {}
    for of in tomllib.loads(_materials())["material"]:
        back = (of["back"]["absorptivity"], of["back"]["emissivity"]) if of["sides"] == "both" else None
        below = of.get("over")
        over = (below["effective_emittance"], stored(below), below["thickness"] * below["conductivity"]) if below else None
        found[of["match"]] = Finish(of["absorptivity"], of["emissivity"], stored(of), back, of["conductivity"] * of["thickness"], over)
    return found


def truth(exchange: bool, edge: float = 0.4, patch: float = 1.5, rays: int = 256, samples: int = 8, spans: int = 2) -> list:
    """Rows of the truth on a mesh of these edges [m]; light is found anew every step, or every `spans` steps."""
    from ..balance import Absorbed, Balance
    from ..case import SIGMA
    from ..fields import read
    from ..lit import sunlight
    from ..orbit import Eclipse, period, sun_of_body
    from ..radiosity import Radiosity
    from ..rays import Rays
    from ..surface import Surface

    of_parts = parts()
    surface = Surface(of_parts, edge)
    balance = Balance(surface, _finishes())
    down = (np.array([0.0, 0.0, 1.0]), np.arcsin(RADIUS / (RADIUS + ALTITUDE)))
    seen = Radiosity(surface, balance.side, patch if exchange else 1e9, rays, planet=down, alone=not exchange)
    pose = Absorbed(balance, seen if exchange else None)
    print(f"  {len(surface.vertices)} vertices, {len(surface.faces)} faces, {seen.count} patches", flush=True)
    scene = Rays(np.concatenate([part.triangles for part in of_parts]))
    turn, beta = 2 * np.pi / period(RADIUS + ALTITUDE), np.radians(BETA_DEG)
    eclipse = Eclipse(0.0, beta, RADIUS, RADIUS + ALTITUDE, STEP * STEPS)
    times = np.arange(0, STEPS + 1, spans) * STEP
    none = np.zeros(len(balance.side.face))
    direct, albedo = [], []
    # What patches send over the run: sunlight without eclipse, the planet's sunlight, infrared.
    sent = [], [], []
    for time in times:
        sun = sun_of_body(turn * time, beta)
        dark = max(eclipse(time - spans * STEP), eclipse(time), eclipse(time + spans * STEP)) == 0
        on_sides = none if dark else sunlight(surface, balance.side, sun, samples, scene)
        direct.append(pose.light(on_sides, none)[0].astype(np.float32))
        of_planet = ALBEDO * 1361.0 * seen.albedo_share(sun)
        albedo.append(pose.light(of_planet, none)[0].astype(np.float32))
        if exchange:
            sent[0].append(seen.sent(none, on_sides, 1))
            sent[1].append(seen.sent(none, of_planet, 1))
    infrared = PLANET * seen.planet_share()

    def absorbed(time: float, kelvin: np.ndarray) -> np.ndarray:
        place = min(time / (spans * STEP), len(times) - 1 - 1e-9)
        low, share = int(place), place - int(place)
        if exchange and len(sent[2]) <= time / STEP:
            own = balance.side.emissivity * SIGMA * (surface.of_corners @ kelvin**4)[balance.side.face]
            sent[2].append(seen.sent(own, infrared, 0))
        light = eclipse(time) * (direct[low] * (1 - share) + direct[low + 1] * share) + albedo[low] * (1 - share) + albedo[low + 1] * share
        return pose.total(light, infrared, kelvin)

    keep = list(range(EVERY, STEPS + 1, EVERY))
    found = balance.run(INITIAL, STEP, STEPS, absorbed, keep, parts=1 if exchange else 2)
    rows = read(surface, CAMERA, found, 400, by_part=True)
    if not exchange:
        return at_places(rows)
    sent[2].append(sent[2][-1])
    return at_places(rows, (seen, sent))


def at_places(rows: list, around: tuple | None = None) -> list:
    """The same rows, with the own balance of each place where a surface does not conduct: elements of .4 m smear edges of shadows there, and are 4.4 K rms off.
    `around`: the radiosity, and what its patches send over the run, in three lists."""
    from ..orbit import Eclipse, period, sun_of_body
    from ..places import barycentric, followed, planet_light
    from ..rays import Rays

    of_parts = parts()
    foil = {number for number, part in enumerate(of_parts) if part.material == FOIL}
    wanted = sorted({row[1:4] for row in rows if row[3] in foil})
    triangles = np.concatenate([part.triangles for part in of_parts])
    scene = Rays(triangles)
    origins, directions = CAMERA.rays()
    pixel = np.array([v * CAMERA.width + u for u, v, _ in wanted])
    hit, distance = scene.first(origins[pixel], directions[pixel])
    places = origins[pixel] + distance[:, None] * directions[pixel]
    # Round parts have the normals that their file states.
    weights = barycentric(triangles[hit], places)
    normals = np.einsum("nk,nkd->nd", weights, np.concatenate([part.normals for part in of_parts])[hit])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turn, beta = 2 * np.pi / period(RADIUS + ALTITUDE), np.radians(BETA_DEG)
    eclipse = Eclipse(0.0, beta, RADIUS, RADIUS + ALTITUDE, STEP * STEPS)
    times = np.arange(STEPS + 1) * STEP
    suns = np.array([sun_of_body(turn * time, beta) for time in times])
    share, albedo = planet_light(normals, np.array([0.0, 0.0, 1.0]), np.arcsin(RADIUS / (RADIUS + ALTITUDE)), suns, behind=(places, scene) if around else None)
    finish = _finishes()[FOIL]
    received = [np.zeros((2, len(places)))] * 3
    if around is not None:
        factors = around[0].seen_from(places, normals, 4096)
        received = [np.array(of) @ factors.T for of in around[1]]

    def at(values: np.ndarray, part: float) -> np.ndarray:
        place = part * (len(values) - 1)
        low = min(int(place), len(values) - 2)
        return values[low] * (low + 1 - place) + values[low + 1] * (place - low)

    def other(time: float) -> np.ndarray:
        part = time / (STEP * STEPS)
        direct, reflected, infrared = (at(of, part) for of in received)
        sunlight = ALBEDO * 1361.0 * at(albedo, part) + eclipse(time) * direct + reflected
        return finish.absorptivity * sunlight + finish.emissivity * (PLANET * share + infrared)

    keep = sorted({row[0] for row in rows})
    found = followed(places, normals, finish, scene, lambda time: (sun_of_body(turn * time, beta), 1361.0 * eclipse(time)), other, INITIAL, STEP, keep)
    own = {(step, *where): float(found[step][number]) for number, where in enumerate(wanted) for step in keep}
    return [(*row[:4], own.get(tuple(row[:4]), row[4])) for row in rows]


EXCHANGE = "[exchange]\npatch_edge = 8.0"
FINDS = "light at vertices, exchange that has not converged"
CASES = [
    Case("station_cut_1m", _build(1.0, ""), lambda: truth(False), Bounds(rms=1.5, p99=8.0), data="station_cut", long=True, parts=NAMES, finds=FINDS),
    Case("station_cut_exchange", _build(4.0, EXCHANGE), lambda: truth(True, edge=0.6, patch=0.75, samples=4, spans=4), Bounds(rms=3.0, p99=12.0), data="station_cut_exchange", long=True, parts=NAMES, finds=FINDS),
    Case("station_cut_exchange_1m", _build(1.0, EXCHANGE), lambda: truth(True, edge=0.6, patch=0.75, samples=4, spans=4), Bounds(rms=3.0, p99=12.0), data="station_cut_exchange", long=True, parts=NAMES, finds=FINDS),
]
