"""A component with a result that depends on the State that it reads, cycle by cycle."""

import numpy as np

from solfer.components import Component

SOURCES = ("j_arm1_1", "j_arm1_4")
TARGETS = ("j_arm2_1", "j_arm2_4")


class Follow(Component):
    """Moves the right arm as far as the left one has moved since the start."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self._sources, self._targets = (np.array([robot.dof(name) for name in names]) for names in (SOURCES, TARGETS))
        self._offset = np.zeros(len(SOURCES))

    def init(self):
        """See `Component.init`."""
        position = self.model.state.position
        self.model.command.position[:] = position
        self._offset[:] = position[self._targets] - position[self._sources]

    def send(self):
        """See `Component.send`."""
        self.model.command.position[self._targets] = self.model.state.position[self._sources] + self._offset
