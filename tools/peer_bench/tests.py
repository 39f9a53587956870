"""What the comparisons stand on: `PYTHONPATH=tools target/peers/venv/bin/python -m unittest peer_bench.tests`."""

import dataclasses
import os
import struct
import subprocess
import tempfile
import tomllib
import unittest
from pathlib import Path

import numpy as np

from peer_bench import columns, image_mitsuba, image_scenes, images, network_reference
from peer_bench import network_cases as cases
from peer_bench.network_cases import SIGMA, SPACE, Floats, Network
from peer_bench.network_eliminated import Eliminated, eliminate
from peer_bench.network_radau import solve
from peer_bench.record import Spread
from peer_bench.workshop import ROOT


def residual(network: Network, heat: Floats, t: Floats) -> Floats:
    """Net heat of every node [W], straight from the equation of docs/network.md."""
    net = heat - network.emissive_area * SIGMA * (t**4 - SPACE**4)
    for (a, b), value in zip(network.linear, network.conductance, strict=True):
        net[a] += value * (t[b] - t[a])
        net[b] += value * (t[a] - t[b])
    for (a, b), value in zip(network.radiative, network.exchange_area, strict=True):
        net[a] += value * SIGMA * (t[b] ** 4 - t[a] ** 4)
        net[b] += value * SIGMA * (t[a] ** 4 - t[b] ** 4)
    return net


def imbalance(problem: Eliminated) -> float:
    """How far blankets are from their balance, and rates from the network's [W]."""
    now, network = 700.0, problem.network
    t = problem.start + np.linspace(-5.0, 5.0, len(problem.capacitance))
    net = residual(network, network.heat_at(now), problem.whole(now, t))
    rates = problem.rate(problem.heat(now), t) * problem.capacitance
    return float(max(np.abs(net[len(t) :]).max(initial=0.0), np.abs(net[: len(t)] - rates).max()))


PROGRAM = Path(os.environ.get("ISOTHERM", ROOT / "target" / "debug" / "isotherm"))


@unittest.skipUnless(PROGRAM.is_file(), f"{PROGRAM} is not built")
class Files(unittest.TestCase):
    """The files of the networks, as `isotherm network` takes them."""

    def solved(self, text: str) -> subprocess.CompletedProcess[str]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "network.toml"
            path.write_text(text, encoding="utf-8")
            words = [str(PROGRAM), "network", str(path), "--tolerance", "0.05"]
            return subprocess.run(words, capture_output=True, text=True, check=False)

    def test_every_case_is_loaded_and_solved(self) -> None:
        for network in (cases.cube(5), cases.sheet(False, 6), cases.sheet(True, 6), cases.blanket(4)):
            done = self.solved(cases.toml(network))
            self.assertEqual(done.returncode, 0, done.stderr)
            rows = np.loadtxt(done.stdout.splitlines()[1:], delimiter=",")
            self.assertEqual(rows.shape, (len(cases.row_times()), 1 + network.nodes))

    def test_a_heat_too_small_counts_as_0_and_is_told_once(self) -> None:
        network = cases.cube(5)
        self.assertTrue(np.any((network.heat > 0.0) & (network.heat < 1e-15)), "the case has no such heat")
        done = self.solved(cases.toml(network))
        self.assertEqual(done.stderr.count("counts as 0"), 1, done.stderr)
        wrong = self.solved(cases.toml(network).replace("conductance = ", "conductance = -", 1))
        self.assertEqual(wrong.returncode, 2, wrong.stderr)


class Networks(unittest.TestCase):
    """Cases, their elimination, and the reference."""

    def test_eliminated_networks_keep_their_balances(self) -> None:
        for network in (cases.cube(5), cases.sheet(True, 6), cases.blanket(4)):
            self.assertLess(imbalance(eliminate(network)), 1e-11)

    def test_a_wrong_exchange_area_shows(self) -> None:
        network = cases.blanket(4)
        problem = eliminate(network)
        wrong = dataclasses.replace(network, exchange_area=1.01 * network.exchange_area)
        self.assertGreater(imbalance(dataclasses.replace(problem, network=wrong)), 1e-5)

    def test_a_cube_conducts_over_its_edges(self) -> None:
        # 6 n^2 squares have four neighbours each.
        self.assertEqual(len(cases.cube(5).linear), 2 * 6 * 25)

    def test_two_methods_agree_on_the_reference(self) -> None:
        network = cases.sheet(False, 3)
        problem = eliminate(network)
        parts = int(network_reference.fastest(problem) * cases.STEP / network_reference.PRODUCT)
        rows = network_reference.runge_kutta(problem, parts)
        self.assertLess(np.abs(rows - solve(problem, 1e-6)[0]).max(), 1e-4)
        hotter = eliminate(dataclasses.replace(network, heat=1.001 * network.heat))
        self.assertGreater(np.abs(rows - solve(hotter, 1e-6)[0]).max(), 1e-2)

    def test_the_file_holds_the_network(self) -> None:
        network = cases.blanket(3)
        file = tomllib.loads(cases.toml(network))
        self.assertEqual([node["capacitance"] for node in file["node"]], network.capacitance.tolist())
        self.assertEqual(len(file["linear_conductor"]), len(network.linear))
        self.assertEqual(file["node"][-1]["kind"], "arithmetic")


class Columns(unittest.TestCase):
    """The reference of the columns."""

    def test_columns_in_the_dark_cool_as_one_slab(self) -> None:
        # Thin against its conduction, a slab of heat capacity C cools by T^-3 = T0^-3 + 3 e sigma t / C.
        case = columns.case(32, 1) | {
            "conductivity": 0.5,
            "heat_capacity": 1e6,
            "absorbed": 0.0,
            "nodes": 3,
            "frames": 4,
        }
        case |= {"spacing": 0.016}
        t = columns.reference(case)[-1]
        seconds, thickness = 4 * case["frame_s"], 2 * case["spacing"]
        slab = (case["start"] ** -3 + 3.0 * case["emissivity"] * SIGMA * seconds / (1e6 * thickness)) ** (-1 / 3)
        self.assertLess(abs(t[0, 1] - slab), 1.2)
        self.assertGreater(case["start"] - slab, 3.0)


class Images(unittest.TestCase):
    """Radiance, errors and the scenes."""

    def test_radiance_is_that_of_numerics(self) -> None:
        # docs/numerics.md 5, 8 to 14 um.
        kelvin = np.array([300.0, 267.0, 180.0])
        found = image_mitsuba.radiance([8e-6, 14e-6], kelvin)
        self.assertLess(np.abs(found / [54.93346, 31.36853, 2.95681] - 1.0).max(), 1e-6)
        self.assertGreater(np.abs(image_mitsuba.radiance([8e-6, 13.9e-6], kelvin) / found - 1.0).min(), 1e-3)

    def test_errors_count_what_either_draws(self) -> None:
        exact = np.array([[0.0, 2.0], [2.0, 0.0]])
        found = images.error(np.array([[0.0, 2.0], [0.0, 0.0]]), exact)
        self.assertAlmostEqual(found.rms, np.sqrt(0.5))
        self.assertAlmostEqual(found.largest, 1.0)

    def test_the_cube_is_a_glb(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            scene = tomllib.loads(image_scenes.cube(Path(folder)))
            data = (Path(folder) / "cube.glb").read_bytes()
        magic, version, length = struct.unpack("<III", data[:12])
        self.assertEqual((magic, version, length), (0x46546C67, 2, len(data)))
        self.assertEqual(scene["model"]["path"], "cube.glb")


class Records(unittest.TestCase):
    """Statistics."""

    def test_spread(self) -> None:
        spread = Spread.of([3.0, 1.0, 2.0]).scaled(2.0)
        self.assertEqual((spread.median, spread.least, spread.samples), (4.0, 2.0, 3))


if __name__ == "__main__":
    unittest.main()
