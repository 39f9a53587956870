"""Measures a sensor of isotherm from its files."""
