"""The first hour of a newcomer: `tools/newcomer` runs it."""
