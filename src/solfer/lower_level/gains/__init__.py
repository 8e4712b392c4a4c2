"""Gains of the laws: defaults, files, and ramps."""
