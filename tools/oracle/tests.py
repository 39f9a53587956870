"""The references themselves against closed forms: `PYTHONPATH=tools target/oracle/venv/bin/python -m unittest oracle.tests`."""

import unittest

import numpy as np

from . import facing, gltf, rays, shapes
from .balance import Balance, Finish
from .case import SIGMA
from .lit import sunlight
from .orbit import Eclipse, period
from .radiosity import Radiosity
from .surface import Surface


class Closed(unittest.TestCase):
    def test_squares_at_a_right_angle_see_the_textbooks_share(self) -> None:
        # Two unit squares with a common edge: 0.2000 (Howell's catalogue, C-14, w = h = l).
        parts = [gltf.Part("a", "m", shapes.quad([0, 0, 0], [1, 0, 0], [0, 1, 0])), gltf.Part("b", "m", shapes.quad([0, 0, 0], [0, 1, 0], [0, 0, 1]))]
        surface = Surface(parts, 0.12)
        balance = Balance(surface, {"m": Finish(0.5, 0.5, 1000.0)})
        found = Radiosity(surface, balance.side, 9.0, 256)
        between = (found.means @ found.factors).toarray()
        self.assertAlmostEqual(between[0, 1], 0.20004, delta=0.0015)
        self.assertAlmostEqual(between[1, 0], 0.20004, delta=0.0015)

    def test_contour_integrals_give_the_textbooks_share(self) -> None:
        # The same squares, and unit squares at 60 deg: 0.37090 (Feingold 1966, Proc. R. Soc. A 292); points in the middle of cells see the cells of the other.
        lines = np.linspace(0, 1, 41)
        middle = 0.5 * (lines[1:] + lines[:-1])
        x, y = (values.ravel() for values in np.meshgrid(middle, middle / 2, indexing="ij"))
        for degrees, share in ((90.0, 0.20004), (60.0, 0.37090)):
            (along, normal), (other, _) = facing._frames(np.radians(degrees))
            found = facing.factors(x[:, None] * along + y[:, None] * np.array([0, 1.0, 0]), normal, other, (lines[::8], lines[::8] / 2))
            self.assertAlmostEqual(float(found.sum(1).mean()), share, delta=2e-4)

    def test_a_closed_box_at_one_temperature_is_a_black_body(self) -> None:
        surface = Surface([gltf.Part("box", "m", shapes.box([0, 0, 0], [1, 1, 1])[:, ::-1])], 0.3)
        balance = Balance(surface, {"m": Finish(0.5, 0.3, 1000.0)})
        found = Radiosity(surface, balance.side, 0.5, 128)
        own = np.full(len(balance.side.face), 0.3 * SIGMA * 300.0**4)
        arrives = found.received(own, np.zeros_like(own), 0)
        np.testing.assert_allclose(arrives, SIGMA * 300.0**4, rtol=1e-9)

    def test_a_step_casts_the_shadow_of_its_height(self) -> None:
        parts = [gltf.Part("a", "m", shapes.quad([0, 0, 0], [2, 0, 0], [0, 1, 0])), gltf.Part("b", "m", shapes.quad([0, 0, 0], [0, 1, 0], [0, 0, 1]))]
        surface = Surface(parts, 0.05)
        balance = Balance(surface, {"m": Finish(1.0, 1.0, 1000.0)})
        sun = np.array([-np.sqrt(0.5), 0.0, np.sqrt(0.5)])
        flux = sunlight(surface, balance.side, sun, 64)
        floor = surface.part_of == 0
        # Half of the floor is lit, at 45 deg.
        self.assertAlmostEqual(float((flux * surface.area)[floor].sum()), 1361.0 * np.sqrt(0.5), delta=2.0)

    def test_a_wave_of_temperature_conducts_its_heat(self) -> None:
        surface = Surface([gltf.Part("a", "m", shapes.quad([0, 0, 0], [2, 0, 0], [0, 0.5, 0]))], 0.06)
        balance = Balance(surface, {"m": Finish(0.0, 1e-12, 1000.0, conducts=1.0)})
        wave = np.cos(np.pi * surface.vertices[:, 0] / 2)
        kelvin = 300 + 10 * wave
        # The heat that the wave drives, integral of k |grad T|^2; single lumped nodes are less exact than that.
        self.assertAlmostEqual(float(kelvin @ (balance.stiffness @ kelvin)), (10 * np.pi / 2) ** 2 * 0.5, delta=0.1)

    def test_free_cooling_follows_its_closed_form(self) -> None:
        surface = Surface([gltf.Part("a", "m", shapes.quad([0, 0, 0], [1, 0, 0], [0, 1, 0]))], 2.0)
        balance = Balance(surface, {"m": Finish(0.5, 0.8, 500.0)})
        found = balance.run(400.0, 10.0, 60, lambda _, kelvin: np.zeros(len(kelvin)), [60], parts=4)
        exact = (400.0**-3 + 3 * 0.8 * SIGMA * 600 / 500) ** (-1 / 3)
        np.testing.assert_allclose(found[60], exact, atol=0.01)

    def test_an_eclipse_is_as_long_as_geometry_says(self) -> None:
        orbit, planet = 6371e3 + 408e3, 6371e3
        eclipse = Eclipse(0.0, 0.0, planet, orbit, period(orbit))
        dark = float(np.trapezoid(1 - eclipse.share, eclipse.times))
        self.assertAlmostEqual(dark, period(orbit) * np.arcsin(planet / orbit) / np.pi, delta=1.0)
        self.assertGreater(float(((eclipse.share > 0.01) & (eclipse.share < 0.99)).sum()), 100)

    def test_places_on_the_sun_fill_its_disc(self) -> None:
        sun = np.array([0.0, 0.6, 0.8])
        directions = rays.on_the_sun(sun, rays.numbers(4096, 2, 1))
        angle = np.arccos(np.clip(directions @ sun, -1, 1))
        self.assertLessEqual(float(angle.max()), rays.SUN_ANGLE * 1.000001)
        self.assertAlmostEqual(float(np.mean(angle < rays.SUN_ANGLE / 2)), 0.25, delta=0.01)


if __name__ == "__main__":
    unittest.main()
