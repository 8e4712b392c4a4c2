"""Recordings for programs that do not read MCAP."""
