"""Isotherm beside its peers on the same work: what `tools/peers` runs."""
