"""Takes image and depth with the unmodified SurRender client, and compares them with the EXR file of `isotherm render`.

python -m serve_clients.surrender ISOTHERM FOLDER needs Python 3.11, numpy 1.23.5, and the client (https://github.com/SurRenderSoftware/surrender_client_API,
Apache 2.0) on its path.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from opencv_points.exr import read
from surrender.surrender_client import surrender_client

from . import craft
from .rotations import quaternion


def pictures(port: int, file: Path) -> list[str]:
    """What is wrong with the pictures of the pose and time of a file."""
    channels, header = read(file)
    height, width = channels["L"].shape
    lens = header["isotherm_camera_opencv_matrix"]
    camera = np.array(header["isotherm_camera_from_body"])
    turn, place = camera[:3, :3].T, -camera[:3, :3].T @ camera[:3, 3]
    client = surrender_client()
    client.connectToServer("127.0.0.1", port)
    print(client.version())
    client.closeViewer()
    client.setConventions(client.SCALAR_XYZ_CONVENTION, client.Z_FRONTWARD)
    client.enableDoublePrecisionMode(True)
    client.enableRaytracing(True)
    client.setNbSamplesPerPixel(4)
    client.createBRDF("sun", "sun.brdf", {})
    client.createShape("sun", "sphere.shp", {"radius": 6.9e8})
    client.createBody("sun", "sun", "sun", [])
    client.setSunPower([1e23] * 4)
    client.setObjectPosition("sun", (1.5e11, 0, 0))
    client.createBRDF("mate", "mate.brdf", {})
    client.createMesh("target", "craft.toml", 1.0)
    client.setObjectElementBRDF("target", "target", "mate")
    client.setImageSize(width, height)
    client.setCameraFOVRad(2 * np.arctan(width / 2 / lens[0, 0]), 2 * np.arctan(height / 2 / lens[1, 1]))
    client.setObjectPosition("target", (0, 0, 0))
    client.setObjectAttitude("target", (1, 0, 0, 0))
    client.setObjectPosition("camera", tuple(place))
    client.setObjectAttitude("camera", tuple(quaternion(turn)))
    assert list(client.getConventions()) == [1, 1] and client.exists("target")
    client.runLuaCode(f"isotherm.step_to({header['isotherm_time_s']!r})")
    client.render()
    image, depth = client.getImageGray32F(), client.getDepthMap()
    wrong = []
    # Turning the pose into a quaternion and back moves an edge by 1e-13 m at most.
    edges = int(((depth > 0) != (channels["part"] != 0)).sum())
    both = (depth > 0) & (channels["part"] != 0)
    radiance = float(np.abs(image - channels["L"])[both].max())
    metres = float(np.abs(depth - channels["Z"])[both].max())
    same = float((image == channels["L"]).mean())
    print(f"{both.sum()} pixels of the craft; {100 * same:.2f} % the same bit for bit; at most {radiance:.2g} W/m2/sr and {metres:.2g} m apart; {edges} at edges")
    if edges > 1 or radiance > 1e-4 or metres > 1e-4:
        wrong.append("the pixels are not those of isotherm render")
    if np.abs(np.flipud(image) - channels["L"])[both].max() < 1:
        wrong.append("a picture upside down passes too")
    if client.getImage().shape != (height, width, 4) or np.any(client.getImageSpectrumProjection([1, 0, 0, 0]) != image):
        wrong.append("the channels are not all the radiance")
    try:
        client.getNormalMap()
        wrong.append("a call that is not done raises nothing")
    except RuntimeError as error:
        print(f"raised as it should: {str(error).strip()}")
    return wrong


def main() -> int:
    isotherm, folder = str(Path(sys.argv[1]).absolute()), Path(sys.argv[2]).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    craft.write(folder, 1000.0, (160, 128), 20.0, tables=False)
    subprocess.run([isotherm, "render", "craft.toml", "--time", "300", "-o", "at_300.exr"], cwd=folder, check=True)
    arguments = [isotherm, "serve", "craft.toml", "--protocol", "surrender", "--listen", "127.0.0.1:0"]
    server = subprocess.Popen(arguments, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        port = int(server.stdout.readline().rsplit(":", 1)[1])
        wrong = pictures(port, folder / "at_300.exr")
    finally:
        server.terminate()
        server.wait(60)
    print("\n".join(f"FAILED: {sentence}" for sentence in wrong) or "ok: the SurRender client sees what isotherm render draws")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
