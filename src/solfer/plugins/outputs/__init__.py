"""Outputs of a plugin: the start blend, the command gate, and the last commands."""
