"""A ROS node with several plugins that are switched on and off at random; whoever uses it is a node already."""

import json
import time

import numpy as np
import rosgraph
import rospy
from std_srvs.srv import SetBool, Trigger
from support.processes import until

from solfer.srv import ListControllers

WAIT = 60.0
"""Bound of every wait, on a machine that has much else to do [s]."""


class SwitchedNode:
    """The plugins of `test/ros/several.py`, as the services of the node show them.

    Args:
        names: Its plugins.
        together: Those of them that run side by side.
        seed: Seed of the switches.

    Attributes:
        switches: How often a plugin was switched on or off.
    """

    def __init__(self, names, together, seed=0):
        self._names, self._together, self._rng = list(names), list(together), np.random.default_rng(seed)
        self._on, self.switches = dict.fromkeys(names, True), 0
        for name in names:
            rospy.wait_for_service(f"/{name}/switch", WAIT)
        self._switches = {name: rospy.ServiceProxy(f"/{name}/switch", SetBool, persistent=True) for name in names}
        rospy.wait_for_service("/limbs/count", WAIT)
        self._count = rospy.ServiceProxy("/limbs/count", Trigger, persistent=True)
        self._list = rospy.ServiceProxy("/lower_level/list_controllers", ListControllers)

    def owners(self):
        """Return who commands each controller."""
        return [owner for owner in self._list().claimed_by if owner]

    def switch(self, name, on):
        """Switch a plugin on or off."""
        reply = self._switches[name](on)
        assert reply.success, reply.message
        self._on[name] = on
        self.switches += 1

    def switch_at_random(self, count):
        """Switch `count` times, at random moments; then all are at rest."""
        for _ in range(count):
            name = str(self._rng.choice(self._names))
            self.switch(name, not self._on[name])
            time.sleep(self._rng.uniform(0.0, 0.05))
        self.rest()

    def rest(self):
        """Switch all plugins off, and wait until nobody has a claim."""
        for name in self._names:
            if self._on[name]:
                self.switch(name, False)
        until(lambda: not self.owners(), "joints that were given back")

    def held(self):
        """Count what the node holds, when its calls have ended: threads and files."""
        counts = [self._counted()]
        until(lambda: counts.append(self._counted()) or counts[-1] == counts[-2], "counts that stay")
        return counts[-1]

    def cost(self):
        """Measure the median cycle with plugins that command all joints [us]; then all are at rest."""
        for name in self._together:
            self.switch(name, True)
        until(lambda: len(self.owners()) == len(self._together), "plugins that have their joints")
        time.sleep(4.0)
        cost = json.loads(self._count().message)["cycle [us]"]
        self.rest()
        return cost

    def _counted(self):
        time.sleep(0.3)
        counts = json.loads(self._count().message)
        return {name: counts[name] for name in ("threads", "files")}


def left_at_master(node="/limbs"):
    """List the topics and services of a node that the master still knows."""
    state = rosgraph.Master(rospy.get_name()).getSystemState()
    return [name for part in state for name, nodes in part if node in nodes]
