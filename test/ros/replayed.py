"""What plugins do on the memory middleware, step by step as in lock-step under ROS."""

import contextlib
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from recording import STEP

from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, generate

sys.path.append(str(Path(os.path.realpath(__file__)).parents[1]))
from support.integration.world import CONFIG, World  # noqa: E402


class ShippedWorld(World):
    """CENTAURO with the sensors that it is shipped with, as under ROS."""

    is_perfect = False


def replay(
    plugins: Sequence[str],
    requests: Sequence[tuple[int, str, Mapping[str, object]]],
    last: int,
    measured: Mapping[str, str],
    commanded: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, dict[int, object]]:
    """Run plugins with a simulated robot.

    Args:
        plugins: Their names, in the order of their cycles.
        requests: Steps, services and their fields, in the order of the steps.
        last: The step with which all ends.
        measured: Topics of the robot, and their messages.
        commanded: Topics of the plugins, and their messages; their clock is that of the bus.

    Returns:
        By topic: the messages by step.
    """
    with contextlib.closing(ShippedWorld()) as world:
        bus = world.bus
        bus.call("simulator/pause", data=True)
        observer = MemoryMiddleware(bus, "observer")
        made = []
        for name in plugins:
            configuration = load(CONFIG / "centauro.yaml", name)
            generator = Registry().find(name, configuration.module.class_)
            made.append(generate(configuration, MemoryMiddleware(bus, name), generator))
        bus.run_until(bus.time + STEP / 2.0)  # plugins run between two steps of the simulation
        begin = bus.time
        bus.call("simulator/pause", data=False)
        for plugin in made:
            bus.every(1.0 / plugin.rate, plugin.cycle, begin + STEP)
        queues = {
            (topic, before): observer.queue(topic, message, last)
            for topics, before in ((measured, 0.0), (commanded, begin))
            for topic, message in topics.items()
        }
        for step, service, fields in requests:
            bus.run_until(begin + (step - 0.25) * STEP)
            bus.call(service, **fields)
        bus.run_until(begin + last * STEP)
        return {
            topic: {round((each.stamp - before) / STEP): each for each in queue.drain()}
            for (topic, before), queue in queues.items()
        }
