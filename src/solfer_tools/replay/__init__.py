"""Replay: recorded feedback through a plugin, whose commands are compared with the recorded ones."""
