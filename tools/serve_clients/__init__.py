"""Tests `isotherm serve` and `isotherm run --mcap` with the unmodified programs of others: Basilisk, rosbags and mcap-ros2-support."""
