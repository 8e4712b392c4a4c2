"""Pipes that carry the wrenches of contacts."""
