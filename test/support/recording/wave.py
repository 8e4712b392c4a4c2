"""A component of 15 lines: what it wants depends on all that it has received."""

import math

from solfer.components import Component


class Wave(Component):
    def init(self):
        self._time, self._begin = 0.0, self.model.state.position.copy()

    def update(self):
        self._time += self.period
        wanted, position = self.model.command.position, self.model.state.position
        wanted[:] = 0.9 * wanted + 0.1 * self._begin + 0.04 * math.sin(math.pi * self._time)
        wanted += 0.03 * (wanted - position)
