"""Operational-space pipes: pose and twist of a link, and of the floating base."""
