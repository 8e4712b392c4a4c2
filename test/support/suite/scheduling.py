"""Which process runs which tests, where several share them."""

from xdist.scheduler import LoadFileScheduling

UNHURRIED = frozenset(
    ("figure_4", "figure_5", "inverse_kinematics", "lockstep", "nodes", "robot", "table_1", "wheeled_motion")
)
"""Rostests that may run beside others: their simulation waits for its plugins, all go by its time, or there is none."""


class Scheduling(LoadFileScheduling):
    """Keeps tests of one file together, for its fixtures, in the order of collection, the slow ones first.

    All rostests are one file: one process runs them one after the other, since two simulations in real time beside
    each other stall the plugins that they test; but UNHURRIED ones. A test that ends its process has failed: it does
    not run again, and the process that replaces this one runs the tests that are left.
    """

    def schedule(self):
        """Hand out tests. A process runs its last test only when it has more of them, or was shut down."""
        super().schedule()
        for node in self.nodes:
            self._reschedule(node)

    def remove_node(self, node):
        """Forget a process that has ended; return the test that ended it, None: it was shut down."""
        for unit in self.assigned_work[node].values():
            for test, is_done in unit.items():
                if not is_done:
                    unit[test] = True
                    super().remove_node(node)
                    return test
        return super().remove_node(node)

    def _split_scope(self, nodeid):
        name = nodeid.partition("::test_rostest[")[2].rstrip("]")
        return nodeid if name in UNHURRIED else super()._split_scope(nodeid)
