"""What tests of pipes that measure need of a plugin."""

from solfer.components import Component


class Watcher(Component):
    """Works on the measured state and commands nothing."""
