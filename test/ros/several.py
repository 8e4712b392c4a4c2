#!/usr/bin/env python3
"""A node with several plugins, its components; `<plugin>/switch` starts and stops one of them.

Usage: several.py FILE NAME... The node is `limbs`. A plugin that fails is reported and closed, and the others go on.
The service `count` returns, as JSON, what the process holds, and what its cycles cost.
"""

import gc
import json
import os
import threading
import time
from contextlib import closing

import numpy as np

from solfer.components import Service
from solfer.config import load
from solfer.errors import SolferError
from solfer.middleware.ros import RosMiddleware, RosNode, arguments, run_main
from solfer.plugins import Plugin, Registry, generate
from solfer.transport import Inbox
from solfer.transport.lower_level import Answer, answered_service
from solfer.transport.middleware import TRIGGER, Flag, NoFields

COSTS = 400  # cycles


class PluginsOfANode:
    """The plugins of a node, and its loop.

    Attributes:
        plugins: Those that did not fail.
    """

    def __init__(self, file: str, names: list[str], middleware: RosMiddleware):
        self._middleware, self._inbox, self._costs = middleware, Inbox(), np.zeros(COSTS)
        self.plugins = [self._made(file, name) for name in names]
        service = Service("count", TRIGGER, NoFields, Answer, self._count)
        middleware.serve(middleware.name.lstrip("/"), (service,), self._inbox.submit)

    def run(self) -> int:
        """Cycle until the end is requested, or no plugin is left."""
        deadline, code, cycles = self._middleware.now(), 0, 0
        while self._middleware.running() and self.plugins:
            begin = time.perf_counter()
            self._inbox.apply()
            for plugin in list(self.plugins):
                try:
                    plugin.cycle()
                except SolferError as error:
                    print(f"error: {error}", flush=True)
                    code = error.exit_code
                    self._end(plugin)
            self._costs[cycles % COSTS] = time.perf_counter() - begin
            cycles += 1
            deadline = max(deadline + 1.0 / 200.0, self._middleware.now())
            self._middleware.sleep_until(deadline)
        for plugin in list(self.plugins):
            self._end(plugin)
            code = 0
        return code

    def _made(self, file: str, name: str) -> Plugin:
        settings = load(file, name)
        plugin = generate(settings, self._middleware, Registry().find(name, settings.module.class_))
        service = answered_service(
            "switch", "std_srvs/SetBool", Flag, work=lambda request: plugin.restart() if request.data else plugin.stop()
        )
        self._middleware.serve(name, (service,), self._inbox.submit)
        return plugin

    def _end(self, plugin: Plugin) -> None:
        self.plugins.remove(plugin)
        plugin.stop()
        plugin.close()

    def _count(self, _: NoFields) -> Answer:
        gc.collect()
        held = {
            "threads": len(threading.enumerate()),
            "files": len(os.listdir("/proc/self/fd")),
            "cycle [us]": 1e6 * float(np.median(self._costs)),
        }
        return Answer(message=json.dumps(held))


def main(argv: list[str]) -> int:
    """Run until the end is requested."""
    file, *names = arguments(argv)
    with closing(RosMiddleware(RosNode("limbs", argv))) as middleware:
        return PluginsOfANode(file, names, middleware).run()


if __name__ == "__main__":
    run_main(main)
