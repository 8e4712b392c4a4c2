"""What several tests of table 2 share."""

import numpy as np
from support.table_1 import Listener

from solfer.components import Component, Port

GOALS = np.array([[0.1, -0.2, 0.8], [0.7, 0.5, 0.0], [-0.7, 0.5, 0.0]])  # [m]


class OutsideListener(Listener):
    """Receives, in the RT layer, also what comes from outside."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.inputs["goals"] = Port("position", len(GOALS), required=True)


class Navigator(Component):
    """Publishes goals from outside of the layer."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.outputs["goals"] = Port("position", len(GOALS))
