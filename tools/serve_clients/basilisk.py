"""A Basilisk scenario, unmodified package: a target and a chaser with an off-axis camera on an orbit that leaves the shadow of the Earth.

python -m serve_clients.basilisk PORT FOLDER IMAGES [MODE] writes the pictures, and what Basilisk's own messages say at the time of each, to FOLDER.
A parent must keep the time, because Basilisk waits for the server in native code for ever.
"""

import ctypes
import json
import os
import sys
from pathlib import Path

# The import asks a web host for the version of its data, which the scenario does not need.
for name in ("HTTP_PROXY", "HTTPS_PROXY", "http_proxy", "https_proxy"):
    os.environ[name] = "http://127.0.0.1:9"

import numpy as np  # noqa: E402
from Basilisk.architecture import messaging  # noqa: E402
from Basilisk.simulation import spacecraft  # noqa: E402
from Basilisk.utilities import RigidBodyKinematics as rbk  # noqa: E402
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeGravBody, vizSupport  # noqa: E402

SIZE = (160, 128)
FOV_DEG = 20.0
CAMERA_POSITION = np.array([0.8, -0.35, 0.5])
AU = 149_597_870_700.0
INTERVAL = 10


def sun(days: float) -> np.ndarray:
    """The Sun from the Earth [m] by days since J2000, to 0.01 deg (The Astronomical Almanac, low precision formula)."""
    g = np.radians(357.528 + 0.9856003 * days)
    longitude = np.radians(280.460 + 0.9856474 * days) + np.radians(1.915) * np.sin(g) + np.radians(0.020) * np.sin(2 * g)
    # From the equinox of date to that of J2000: general precession.
    longitude -= np.radians(1.396971 * days / 36525)
    obliquity = np.radians(23.4393)
    distance = AU * (1.00014 - 0.01671 * np.cos(g) - 0.00014 * np.cos(2 * g))
    return distance * np.array([np.cos(longitude), np.cos(obliquity) * np.sin(longitude), np.sin(obliquity) * np.sin(longitude)])


def mrp(matrix: np.ndarray) -> np.ndarray:
    return np.array(rbk.C2MRP(matrix))


def scenario(port: int, folder: Path, images: int, mode: str) -> None:
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(1.0)))
    gravity = simIncludeGravBody.gravBodyFactory()
    earth, star = gravity.createEarth(), gravity.createSun()
    earth.isCentralBody = True
    towards = sun(6939.5)
    bodies = {}
    for body, name, place in ((earth, "earth", np.zeros(3)), (star, "sun", towards)):
        payload = messaging.SpicePlanetStateMsgPayload()
        payload.PositionVector, payload.VelocityVector = place.tolist(), [0.0, 0.0, 0.0]
        payload.J20002Pfix, payload.PlanetName = np.eye(3).tolist(), name
        bodies[name] = messaging.SpicePlanetStateMsg().write(payload)
        body.planetBodyInMsg.subscribeTo(bodies[name])

    # A circular orbit through the shadow; the exit comes after about 500 s.
    radius = 6_771e3
    rate = np.sqrt(earth.mu / radius**3)
    noon = towards / np.linalg.norm(towards)
    normal = np.cross(noon, [0.0, 0.0, 1.0])
    normal = normal / np.linalg.norm(normal)
    across = np.cross(normal, noon)

    def orbit(angle: float) -> tuple[np.ndarray, np.ndarray]:
        up = np.cos(angle) * noon + np.sin(angle) * across
        return radius * up, radius * rate * np.cross(normal, up)

    start = np.radians(180 + 36)
    craft = {}
    for name, angle in (("target", start), ("chaser", start - 45.0 / radius)):
        position, velocity = orbit(angle)
        one = spacecraft.Spacecraft()
        one.ModelTag = name
        one.hub.mHub = 100.0
        one.hub.IHubPntBc_B = [[90.0, 0, 0], [0, 90.0, 0], [0, 0, 90.0]]
        forward = velocity / np.linalg.norm(velocity)
        down = -position / np.linalg.norm(position)
        level = np.array([forward, np.cross(down, forward), down])
        tilt = rbk.MRP2C(np.array([0.12, -0.21, 0.31] if name == "target" else [-0.05, 0.14, 0.22]))
        body = tilt @ level
        one.hub.r_CN_NInit, one.hub.v_CN_NInit = position.reshape(3, 1).tolist(), velocity.reshape(3, 1).tolist()
        one.hub.sigma_BNInit = mrp(body).reshape(3, 1).tolist()
        one.hub.omega_BN_BInit = (body @ (rate * normal)).reshape(3, 1).tolist()
        gravity.addBodiesTo(one)
        simulation.AddModelToTask("task", one)
        craft[name] = (one, position, body)

    # The camera looks at the target, off the axes of the chaser.
    (_, there, _), (_, here, body) = craft["target"], craft["chaser"]
    line = body @ (there - here) - CAMERA_POSITION
    forward = line / np.linalg.norm(line)
    right = np.cross(forward, [0.2, -0.4, 0.9])
    right /= np.linalg.norm(right)
    sigma_cb = mrp(np.array([right, np.cross(forward, right), forward]))

    live = {"liveStream": True} if mode == "live" else {"noDisplay": True}
    viz = vizSupport.enableUnityVisualization(simulation, "task", [craft["target"][0], craft["chaser"][0]], **live)
    viz.reqComAddress, viz.reqPortNumber = "127.0.0.1", str(port)
    vizSupport.createCustomModel(viz, modelPath="craft.toml", simBodiesToModify=["target"], scale=[1.0, 1.0, 1.0])
    if mode != "no-epoch":
        epoch = messaging.EpochMsgPayload()
        epoch.year, epoch.month, epoch.day = 2019, 1, 1
        message = messaging.EpochMsg().write(epoch)
        viz.epochInMsg.subscribeTo(message)
    camera = messaging.CameraConfigMsgPayload()
    camera.isOn, camera.cameraID, camera.parentName = 1, 1, "chaser"
    camera.fieldOfView, camera.resolution = np.radians(FOV_DEG), list(SIZE)
    camera.renderRate = macros.sec2nano(INTERVAL)
    camera.cameraPos_B, camera.sigma_CB, camera.skyBox = CAMERA_POSITION.tolist(), sigma_cb.tolist(), "black"
    camera_message = messaging.CameraConfigMsg().write(camera)
    viz.addCamMsgToModule(camera_message)
    simulation.InitializeSimulation()

    lines = []
    for number in range(1, images + 1):
        simulation.ConfigureStopTime(macros.sec2nano(number * INTERVAL))
        simulation.ExecuteSimulation()
        image = viz.opnavImageOutMsgs[0].read()
        line = {"time": 1e-9 * image.timeTag, "valid": int(image.valid), "sigma_CB": sigma_cb.tolist()}
        if image.valid:
            (folder / f"{number:03}.png").write_bytes(ctypes.string_at(int(image.imagePointer), image.imageBufferLength))
        for name, (one, _, _) in craft.items():
            state = one.scStateOutMsg.read()
            line[name] = {"r": list(state.r_BN_N), "v": list(state.v_BN_N), "sigma": list(state.sigma_BN)}
        lines.append(json.dumps(line))
        (folder / "states.jsonl").write_text("\n".join(lines) + "\n")
    print(f"{images} images")


if __name__ == "__main__":
    scenario(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4] if len(sys.argv) > 4 else "no-display")
    # Basilisk's threads of ZeroMQ may wait for an answer that nobody reads any more.
    sys.stdout.flush()
    os._exit(0)
