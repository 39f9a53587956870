"""Delfi-PQ in flight: telemetry beside runs of isotherm."""
