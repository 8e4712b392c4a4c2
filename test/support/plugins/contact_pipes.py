"""What several tests of contact pipes share."""

from solfer.components import Component


class Watcher(Component):
    """Works on the measured state and commands nothing."""
