"""A component of 15 lines: what it commands depends on all that it has received."""

import math

from solfer.components import Component


class Wave(Component):
    def init(self):
        self._time, self._begin = 0.0, self.model.state.position.copy()

    def update(self):
        self._time += self.period
        desired, position = self.model.command.position, self.model.state.position
        desired[:] = 0.9 * desired + 0.1 * self._begin + 0.04 * math.sin(math.pi * self._time)
        desired += 0.03 * (desired - position)
