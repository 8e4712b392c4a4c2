"""Fig. 5 with navigation and waving hands on one schedule: what each cycle reads depends on the virtual time alone.

In each period the simulation steps first, then who is outside, then the plugins, in the order of the figure. The bridge
of a layer forwards what goes in before the layer's cycle, and what comes out half a period after it, as its node does.
"""

import re
import shutil
from pathlib import Path

import numpy as np
from support.integration.bridged import BridgedWorld
from support.integration.world import CONFIG, STEP, World

from solfer.config import load, load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.middleware.bridge import Bridge
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet, Registry, generate
from solfer.plugins.outputs.start_blend import SHORTEST
from solfer.realtime.executor import ExecutorRules
from solfer_tools.demo.driving import COURSE_RATE
from solfer_tools.demo.waving import Waving
from solfer_tools.navigation import Navigation, ScenarioCourse
from solfer_tools.scenarios import Player, read_scenario

COURSE = CONFIG / "figures" / "course.yaml"
PLUGINS_RATE = 200.0
HANDS = {"left": (0.54, 0.18, 0.28), "right": (0.54, -0.18, 0.28)}
"""Where the hands begin to wave, seen from the pelvis [m]; they go there first."""

FIELDS = ("position", "velocity", "effort")
BEGIN = 1.0 + STEP / 2.0
"""When the robot and the plugins begin in the tests' own time [s]: plugins run between two steps of the simulation."""

FIRST = BEGIN + STEP
"""When their first cycle is [s]."""

BEFORE = 0.1 * STEP
"""Time between two things that are done in one step, in their order [s]."""


def check_equal(found, expected):
    """Check commands, one row for each cycle, to 1e-9 of the largest number of each column, or of 1.

    Where wheels are all but parallel, what carries the robot along them is 1e7 times as sensitive as elsewhere: torques
    of 25 Nm then differ by 5e-9 Nm because clocks that began at different times round differently.
    """
    largest = np.maximum(1.0, np.abs(expected).max(axis=0))
    np.testing.assert_allclose(found / largest, expected / largest, rtol=0.0, atol=1e-9)


def with_filters_of_nodes(folder: Path) -> Path:
    """Copy the shipped configuration, in which a layer has filters for its own rate, with those of nodes in both."""
    made, filters = folder / "config", re.compile(r"    odometry:\n(?:      .*\n)+")
    shutil.copytree(CONFIG, made, ignore=shutil.ignore_patterns("robots", "worlds"))
    (made / "robots").symlink_to(CONFIG / "robots")
    nodes, layer = (made / "support" / f"{each}.yaml" for each in ("NRT", "RT"))
    (found,) = filters.findall(nodes.read_text())
    text, count = filters.subn(found, layer.read_text())
    assert count == 1
    layer.write_text(text)
    return made


class Outside:
    """Navigation on the course of the demonstration, and what moves the hands, in one loop.

    Args:
        middleware: Carries all of it.
    """

    def __init__(self, middleware):
        player = Player(read_scenario(COURSE), 1.0 / COURSE_RATE)
        course = ScenarioCourse(middleware, player, "locomotion", "odometry/odom", positions=True)
        self.navigation = Navigation(middleware, course, "navigation", COURSE_RATE)
        self._waving = Waving(middleware, "hands", {name: np.array(place) for name, place in HANDS.items()})
        self._now, self._begin = middleware.now, None

    def cycle(self, *_):
        """Carry out one period."""
        now = self._now()
        self._begin = now if self._begin is None else self._begin
        self.navigation.cycle()
        self._waving.send(now - self._begin)


class _Scheduled:
    """What both worlds have; the robot stands still until all are there.

    Attributes:
        outside: Navigation and waving.
        names: Controller, field and joint of each number that is sent to the lower level.
        sent: These numbers, one row for each cycle.
    """

    is_perfect = False

    def __init__(self, *args):
        super().__init__(*args)
        self.pause(True)
        self.bus.run_until(0.1)
        self._sets = self._made()
        pipes = [
            pipe
            for each in self._sets
            for managed in each.plugins
            if managed.name == "full_compensation"
            for pipe, _ in managed.plugin.outputs.controllers
        ]
        fields = [(pipe, name) for pipe in pipes for name in FIELDS if getattr(pipe.sent, name) is not None]
        self.names = tuple((pipe.name, name, joint) for pipe, name in fields for joint in pipe.sent.names)
        self._numbers, self.sent = [getattr(pipe.sent, name) for pipe, name in fields], []
        self.bus.run_until(BEGIN)
        self.pause(False)
        self.outside = Outside(MemoryMiddleware(self.bus, "driver"))
        self.bus.every(1.0 / COURSE_RATE, self.outside.cycle, FIRST - 2.0 * BEFORE)
        self._schedule()
        for each in self._sets:
            names = [managed.name for managed in each.plugins]
            each.switchboard.commit(each.switchboard.plan(names))
            self.bus.every(1.0 / each.rate, each.cycle, FIRST)
        self.bus.every(1.0 / PLUGINS_RATE, self._note, FIRST + BEFORE)

    def play(self, duration):
        """Let time pass from the beginning on [s]."""
        self.bus.run_until(BEGIN + duration + 0.5 * STEP)
        return self

    def _schedule(self):
        """Schedule what else there is."""

    def _note(self):
        self.sent.append(np.concatenate(self._numbers))


class ScheduledNodes(_Scheduled, World):
    """As nodes, of which `full_control` has several plugins."""

    def _made(self):
        registry, file = Registry(), CONFIG / "centauro.yaml"
        alone = load(file, "hands").at(PLUGINS_RATE)
        generator = registry.find("inverse_kinematics", alone.module.class_)
        together = self.together(load_shared(file, "full_control", default=registry.configuration).plugins)
        return [PluginSet([generate(alone, MemoryMiddleware(self.bus, "hands"), generator)]), together]


class ScheduledLayer(_Scheduled, BridgedWorld):
    """As the layer of config/figures/figure_5.yaml under its executor, at the rate of the nodes."""

    def __init__(self, folder):
        file = with_filters_of_nodes(folder) / "figures" / "figure_5.yaml"
        self._listed = read_layer(file, Registry().configuration).at(PLUGINS_RATE).load()
        super().__init__(folder, [each.configuration for each in self._listed])

    def _made(self):
        executor = self.executor(self._listed, ExecutorRules(blend=SHORTEST))
        self.bridge.cycle()
        return [executor]

    def _schedule(self):
        self.bus.every(Bridge.PERIOD, self.bridge.receive, FIRST - BEFORE)
        self.bus.every(Bridge.PERIOD, self.bridge.publish, FIRST + 0.5 * Bridge.PERIOD)
