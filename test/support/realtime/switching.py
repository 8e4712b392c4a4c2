"""A real-time layer in shared memory whose plugins are switched on and off at random, and what it holds meanwhile."""

import gc
import os
import threading
import time
from collections import deque

import numpy as np
from support.integration.xbot_world import XbotWorld
from support.plugins.components import PARTS, parts
from support.realtime.executor_plugins import Layer

from solfer.lower_level.server.services import SwitchRequest
from solfer.realtime.executor import ExecutorRules
from solfer.transport.lower_level import Answer

STAY = ["bells", "simulated_time"]
"""What a namespace keeps without its nodes."""

COSTS = 400  # cycles
WAIT = 60.0  # [s]
TOGETHER = ("springs", "drives")
"""Plugins that run side by side; every second one claims the joints of the others."""


def held():
    """Count what this process holds: threads and open files."""
    gc.collect()
    return {"threads": threading.active_count(), "files": len(os.listdir("/proc/self/fd"))}


class SwitchedLayer(Layer):
    """An executor with plugins that claim the same joints, switched by the services of the layer.

    Args:
        folder: Where its files and its namespace are.
        seed: Seed of the switches.

    Attributes:
        nodes: The nodes of its plugins and of who switches them.
        switches, refused: How often they were switched, and how often that was refused.
    """

    def __init__(self, folder, seed=0):
        self.nodes, self.switches, self.refused = [], 0, 0
        self._rng, self._costs, self._folder = np.random.default_rng(seed), deque(maxlen=COSTS), folder / "namespace"
        self._folder.mkdir()
        path, world = parts(folder), XbotWorld(self._folder)
        plugins = [(name, path) for name in PARTS]
        super().__init__(world, folder / "estop", plugins, ExecutorRules(blend=0.02), middleware="XBOT")
        self._asker = self.node("asker")

    def begin(self):
        """See `Layer.begin`."""
        self.world.bus.every(1.0 / self.executor.rate, self._cycle)

    def node(self, name):
        """See `Layer.node`."""
        self.nodes.append(super().node(name))
        return self.nodes[-1]

    def switch(self, start=(), stop=()):
        """Ask for a switch; returns whether it was done."""
        request, end = SwitchRequest(tuple(start), tuple(stop)), time.monotonic() + WAIT
        answer = self._asker.request("xbotcore/switch", "solfer/SwitchControllers", request, Answer, 5.0)
        while not answer.done():
            assert time.monotonic() < end, "a switch is not answered"
            self.world.run(0.002)  # it is prepared in a thread, which takes real time
            self._asker.poll()
        self.switches += 1
        self.refused += not answer.result().success
        return answer.result().success

    def switch_each(self):
        """Switch each plugin on and off, one after the other: what is made at the first use is there then."""
        for name in PARTS:
            assert self.switch([name])
            self.world.run(0.4)  # of all of them together longer than until the first health report
            assert self[name].plugin.running
            self.rest()

    def switch_at_random(self, count):
        """Switch `count` times, at random moments; then all are at rest."""
        for _ in range(count):
            chosen = self._rng.permutation(list(PARTS))[: self._rng.integers(1, len(PARTS) + 1)].tolist()
            active = [name for name in chosen if self[name].active]
            self.switch([name for name in chosen if name not in active], active)
            self.world.run(self._rng.uniform(0.0, 0.06))
        self.rest()

    def rest(self):
        """Stop all plugins, and wait until they are at rest."""
        active = [name for name in PARTS if self[name].active]
        assert not active or self.switch(stop=active)
        self.world.run(0.1)
        assert all(managed.at_rest for managed in self.executor.plugins)

    def cost(self):
        """Measure the median cycle with plugins that command all joints [us]; then all are at rest."""
        self.world.simulation.reset()  # at each start the springs give way a little, until joints are at their limits
        self.world.run(0.3)
        assert self.switch(TOGETHER)
        self.world.run(0.3)
        assert all(self[name].plugin.running for name in TOGETHER)
        self.world.run(COSTS / self.executor.rate)
        cost = 1e6 * float(np.median(self._costs))
        self.rest()
        return cost

    def held(self):
        """Count what the layer holds: threads, files, shared memory, and entries of the claims."""
        claims = self.world.simulation.lower_level.claims
        return held() | {
            "segments": len(self.segments()),
            "leases": len(claims.owners()),
            "claims": sum(len(part) for part in vars(claims).values() if isinstance(part, dict)),
        }

    def segments(self):
        """List the segments in shared memory; their locks stay, for the next segments of these names."""
        files = (path for path in self._folder.rglob("*") if path.is_file() and path.suffix != ".lock")
        return sorted("/".join(path.relative_to(self._folder).parts[1:]) for path in files)

    def close(self):
        """Close all of it; the namespace stays."""
        self.executor.close()
        self.world.run(0.1)
        for node in (*self.nodes, self.world._node, self.world._asker):
            node.close()
        self.executor.estop.close()
        self.world.close()

    def _cycle(self):
        begin = time.perf_counter()
        self.executor.cycle()
        self._costs.append(time.perf_counter() - begin)
