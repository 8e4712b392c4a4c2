"""The shipped component, with a witness of the resets of its simulation."""

from solfer.components import Port
from solfer.components.joint_states import JointStates


class Witness(JointStates):
    """Publishes in `events` how often it was started, reset and updated."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.outputs["events"] = Port("position")
        self._events = self.outputs["events"].value

    def init(self):
        """See `Component.init`."""
        super().init()
        self._events[0] += 1

    def reset(self):
        """See `Component.reset`."""
        super().reset()
        self._events[1] += 1

    def update(self):
        """See `Component.update`."""
        super().update()
        self._events[2] += 1
