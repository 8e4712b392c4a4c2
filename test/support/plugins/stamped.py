"""The plugin `joint_states`, which notes when a change of its parameters takes effect."""

import os
import time

import numpy as np

from solfer.components.joint_states import JointStates

FILE = "SOLFER_STAMPED"
"""Environment variable: file of one number, the time of the first cycle with the newest parameters [ns]."""


class Stamped(JointStates):
    """Writes the time of its first update with other tags than before."""

    def __init__(self, robot, tags, name=""):
        super().__init__(robot, tags, name)
        self._seen, self._stamp = tags, np.memmap(os.environ[FILE], dtype=np.int64, shape=1)

    def update(self):
        if self.tags is not self._seen:
            self._seen, self._stamp[0] = self.tags, time.monotonic_ns()
        super().update()
