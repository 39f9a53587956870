"""Tests the page of `isotherm view` in Chromium, and counts its images."""
