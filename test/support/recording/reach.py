"""A component of 15 lines that takes memory in its cycle, some of it for good, and one that takes none."""

import numpy as np

from solfer.components import Component


class Reach(Component):
    def init(self):
        self._begin, self._errors = self.model.state.position.copy(), []

    def update(self):
        error = self._begin - self.model.state.position
        self._errors.append(error)
        np.multiply(error, 0.5, out=self.model.command.position)
        self.model.command.position += self.model.state.position


class Clean(Component):
    def init(self):
        self._begin = self.model.state.position.copy()

    def update(self):
        command = self.model.command.position
        np.subtract(self._begin, self.model.state.position, out=command)
        command *= 0.5
        np.add(command, self.model.state.position, out=command)
