"""Checks a data set of `isotherm dataset` with the community's own readers."""
