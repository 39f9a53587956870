"""Fits from Python: what the program finds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support import REPOSITORY, program

import isotherm

NETWORK = """
space_temperature = 2.7
[[node]]
label = "panel"
kind = "diffusive"
capacitance = 120
emissive_area = 0.0085
temperature = 285
heat = 9
[[node]]
label = "structure"
kind = "diffusive"
capacitance = 450
temperature = 288
[[linear_conductor]]
nodes = ["panel", "structure"]
conductance = 0.35
"""
PARAMETERS = """
[[parameter]]
vary = "emissive_area"
node = "panel"
percent = 40
[[parameter]]
vary = "conductance"
between = ["panel", "structure"]
percent = 100
"""
TELEMETRY = REPOSITORY / "tests/oracle/fit_network.csv"


def test_a_fit_is_that_of_the_program(tmp_path: Path) -> None:
    network, parameters = tmp_path / "network.toml", tmp_path / "p.toml"
    network.write_text(NETWORK)
    parameters.write_text(PARAMETERS)
    fitted = isotherm.fit(network, measured=[TELEMETRY], parameters=parameters, output=tmp_path / "out")
    assert [parameter["name"] for parameter in fitted["parameters"]][0] == "emissive_area of panel"
    assert fitted["rms"]["after_k"] < fitted["rms"]["before_k"]
    assert json.loads((tmp_path / "out/fit.json").read_text()) == fitted
    program("fit", network, "--measured", TELEMETRY, "--parameters", parameters, "-o", tmp_path / "program")
    assert json.loads((tmp_path / "program/fit.json").read_text()) == fitted


def test_what_does_not_fit_raises(tmp_path: Path) -> None:
    network, parameters = tmp_path / "network.toml", tmp_path / "p.toml"
    network.write_text(NETWORK)
    parameters.write_text(PARAMETERS.replace("emissive_area", "emissive_arae"))
    with pytest.raises(isotherm.SceneError, match="emissive_area"):
        isotherm.fit(network, measured=[TELEMETRY], parameters=parameters)
    parameters.write_text(PARAMETERS)
    with pytest.raises(isotherm.RequestError, match="names nothing that was measured"):
        isotherm.fit(network, measured=[], parameters=parameters)
