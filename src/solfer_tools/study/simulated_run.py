"""A simulated robot with its plugins, on a virtual clock."""

import importlib
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from typing import Any, NamedTuple

import numpy as np

from solfer import config
from solfer.config import SharedConfiguration, load, load_shared, module_names
from solfer.config.loading.layers import Layers
from solfer.config.records.modules import is_shared
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.errors import ComponentError, ConfigError, SolferError, SolferErrors
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Plugin, PluginSet, Registry, generate, generate_shared
from solfer.plugins.generation.dry_run import declared
from solfer.recording.log import Logger, LogSource
from solfer.robot.description.shipped import RobotFiles
from solfer.simulation import SimulationServer
from solfer.simulation.physics import STEP
from solfer.simulation.server.publications import robot_parameters
from solfer.simulation.world.world import WORLD_FILE
from solfer.telemetry.plugin_log import PluginLog
from solfer_tools.navigation import Course, Navigation, ReferenceCourse, ScenarioCourse, read_references
from solfer_tools.scenarios import Player, read_scenario
from solfer_tools.study.measures import Columns
from solfer_tools.study.records import StudyRecord
from solfer_tools.study.robot import bundle_of, faults_of, file_of, simulation_of

MOTION_PERIOD = 0.02
"""Period of what moves the robot [s]."""

Configuration = tuple[str, config.Configuration] | SharedConfiguration
"""A plugin and its configuration, or a shared plugin."""


class _Options(NamedTuple):
    """What a run is given besides its record; see `SimulatedRun`."""

    seed: int
    configurations: list[Configuration]
    kept: tuple[str, ...]
    gui: bool


class SimulatedRun:
    """One run: reset it, step it, observe it; or let it run to its end.

    Equal records and seeds give equal numbers to the last bit.

    Args:
        record: What runs.
        seed: Added to the seeds of the sensors' noise and of the transport.
        changes: What is laid over the configuration's files; None: nothing.
        columns: Columns that are kept besides those of the record's measures, `CHANNEL/COLUMN`.
        gui: Open PyBullet's window.

    Attributes:
        record: See above.
        bus: Topics, services and the clock.
        simulation: The robot.
        plugins: All plugins by name.
        columns: What is kept, from the begin of the motion on.
        failure: Why the run has failed; empty: it has not.
        done: Whether its motion has ended.

    Raises:
        SolferError: The configuration, the robot, or the motion is wrong. SolferErrors: Several mistakes.
        KeyboardInterrupt: Ctrl-C, also in a cycle of a plugin.
    """

    def __init__(
        self,
        record: StudyRecord,
        seed: int = 0,
        changes: YamlNode | None = None,
        columns: Iterable[str] = (),
        gui: bool = False,
    ):
        self.record = record
        self._options = _Options(seed, configurations_of(record, changes), kept=tuple(columns), gui=gui)
        self._stack = ExitStack()
        self.reset()

    def reset(self) -> None:
        """Begin again: everything is made as it was in the beginning, and settles until the motion begins."""
        self._stack.close()
        self.failure = ""
        self.done = False
        self._sets: list[PluginSet] = []
        self._navigation: Navigation | None = None
        record = self.record
        bundle = bundle_of(record.simulation, self._options.seed)
        parameters = robot_parameters(bundle) | {WORLD_FILE: str(file_of(record.simulation, "world"))}
        self.bus = Bus(parameters, faults_of(record.simulation, self._options.seed))
        self.simulation = simulation_of(
            record.simulation, bundle, parameters["/robot_description"], gui=self._options.gui
        )
        self._stack.callback(self.simulation.close)
        server = SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator"))
        self.bus.every(STEP, server.cycle)
        self.plugins: dict[str, Plugin] = {}
        for configuration in self._options.configurations:
            self._add(configuration)
        self._logs: list[_TruthLog | PluginLog] = [_TruthLog(self), *map(PluginLog, self.plugins.values())]
        self._begin = math.inf
        self.columns = Columns(self.sources, self._names(), self._where)
        self._pushes = sorted(record.simulation.pushes, key=lambda push: push.at)
        self.bus.every(0.005, self._sample)
        self._settle()

    @property
    def sources(self) -> list[LogSource]:
        """All channels: those of a recording of the plugins, and those of the true robot."""
        return [source for log in self._logs for source in log.sources]

    @property
    def time(self) -> float:
        """Time since the begin of the motion [s]."""
        return self.bus.time - self._begin

    @property
    def is_over(self) -> bool:
        """Whether the motion has ended, the time is over, or the run has failed."""
        return self.done or bool(self.failure) or self.time >= self.record.duration - 1e-9

    def node(self, name: str) -> MemoryMiddleware:
        """Return a node of one's own, which publishes, receives, and calls services."""
        return MemoryMiddleware(self.bus, name)

    def attend(self) -> None:
        """Let the plugins report their health once a second, and be switched by services, as in nodes with several."""
        for index, together in enumerate(self._sets):
            together.switchboard.serve(self.node("loops"), f"loop_{index}", together.inbox.submit)
        self.every(1.0, self._report)

    def _report(self) -> None:
        for together in self._sets:
            for managed in together.plugins:
                self.node("loops").report(managed.name, *managed.health(), managed.plugin.figures())

    def every(self, period: float, work: Callable[[], None]) -> None:
        """Do some work once each `period` [s] from now on, after the plugins."""
        self.bus.every(period, work)

    def step(self, duration: float = MOTION_PERIOD) -> None:
        """Let a time pass [s]; a run that has failed stays as it is."""
        end = self.bus.time + duration
        while not self.failure and self.bus.time < end - 1e-12:
            until = end
            if self._pushes:
                due = self._begin + self._pushes[0].at
                until = min(end, due)
                if due <= self.bus.time + 1e-12:
                    push = self._pushes.pop(0)
                    self.simulation.pushes.add(push.link, push.force, (0.0, 0.0, 0.0), push.duration)
                    continue
            self._run_until(until)

    def observe(self) -> dict[str, float]:
        """Return the newest number of each column that is kept; NaN before the first."""
        columns = self.columns
        return {name: float(columns[name][-1]) if columns.count else math.nan for name in columns.names}

    def run_to_end(self) -> None:
        """Step until the run is over, by the function of the record if it names one."""
        function = self.record.motion.function
        if function is not None:
            self._call(function)
            self.done = not self.failure
            return
        while not self.is_over:
            self.step(min(MOTION_PERIOD * 5, max(self.record.duration - self.time, STEP)))
        if not self.done and not self.failure and self._navigation is not None:
            waits = f": it waits for {self._navigation.waits}" if self._navigation.waits else ""
            self.failure = f"the motion is not over after {self.record.duration:g} s{waits}"

    def close(self) -> None:
        """Release the simulation. May be called twice."""
        self._stack.close()

    def __enter__(self) -> "SimulatedRun":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _add(self, configuration: Configuration) -> None:
        """Make the plugins of a node."""
        registry = Registry()
        if isinstance(configuration, SharedConfiguration):
            members = generate_shared(
                configuration.plugins, lambda each: MemoryMiddleware(self.bus, each.module.name), registry
            )
            plugins = members.plugins
            polls = [members.sharing.turns.next]
            requires = members.requires
            together = PluginSet(plugins, nanoseconds=self.nanoseconds, polls=polls, requires=requires)
        else:
            plugin, loaded = configuration
            generator = registry.find(plugin, loaded.module.class_)
            plugins = (generate(loaded, MemoryMiddleware(self.bus, loaded.module.name), generator),)
            together = PluginSet(plugins, nanoseconds=self.nanoseconds)
        for each in plugins:
            if each.name in self.plugins:
                raise ConfigError(
                    f"two plugins are named '{each.name}'", where=self.record.where("plugins"), expected="each one once"
                )
            self.plugins[each.name] = each
        together.start()
        self._sets.append(together)
        self._stack.callback(together.close)
        self.bus.every(1.0 / together.rate, lambda: self._cycle(together), cycles=True)

    def _cycle(self, together: PluginSet) -> None:
        together.cycle()
        if together.failures and not self.failure:
            name, error = next(iter(together.failures.items()))
            if isinstance(error, KeyboardInterrupt):  # in this process Ctrl-C is the user's, no component's
                raise error
            self.failure = f"{name}: {error}"

    def nanoseconds(self) -> int:
        """Return the time of the bus [ns]."""
        return round(1e9 * self.bus.time)

    def _run_until(self, end: float) -> None:
        """Let time pass until `end` [s], and note what fails."""
        try:
            self.bus.run_until(end)
        except (SolferError, SolferErrors) as error:
            self.failure = self.failure or str(error)
        fallen = self.simulation.lower_level.safeguard.reason
        if fallen and not self.failure:
            self.failure = fallen

    def _settle(self) -> None:
        """Wait until all plugins run, for the time of the record at least, and begin the motion."""
        begin = self.bus.time
        self._run_until(begin + self.record.settle)
        plugins = self.plugins.values()
        while not self.failure and (waiting := next((plugin for plugin in plugins if not plugin.running), None)):
            if self.bus.time - begin > 10.0 + self.record.settle:  # the plugins take some time to start
                self.failure = f"{waiting.name} {waiting.health()[1]}"
            self._run_until(self.bus.time + MOTION_PERIOD)
        self.bus.check_faults()
        self._begin = self.bus.time
        self._sample()
        mover = self.node("navigation")
        course = self._course(mover)
        if course is not None:
            self._navigation = Navigation(mover, course, mover.name, rate=1.0 / MOTION_PERIOD)
            self.bus.every(MOTION_PERIOD, self._navigate)

    def _course(self, mover: MemoryMiddleware) -> Course | None:
        """Make what moves the robot from a node; None: nothing does, or a function."""
        motion = self.record.motion
        if motion.scenario is not None:
            player = Player(read_scenario(str(motion.scenario.location)), MOTION_PERIOD)
            return ScenarioCourse(mover, player, motion.target, odometry=motion.odometry, positions=motion.positions)
        if motion.references is not None:
            references = read_references(str(motion.references.location))
            return ReferenceCourse(mover, references, motion.target, joints="joint_states", states="joint_states")
        return None

    def _navigate(self) -> None:
        navigation = self._navigation
        if navigation is None or navigation.done:
            return
        navigation.cycle()
        self.done = navigation.done

    def _sample(self) -> None:
        if self.bus.time < self._begin or self.is_over:
            return
        for log in self._logs:
            log.take(self.bus.time)
        self.columns.sample(self.time)

    def _names(self) -> list[str]:
        """List the columns that are kept."""
        names = list(self._options.kept)
        for measure in self.record.measure.values():
            for each in measure.names():
                names += each
        return names

    def _where(self, column: str) -> str:
        """Return the place of the measure that names a column."""
        for name, measure in self.record.measure.items():
            if any(column in each for each in measure.names()):
                return self.record.where("measure", name, "columns")
        return ""

    def _call(self, name: str) -> None:
        """Let the function of the record move the robot."""
        function = function_of(name, self.record.motion.where("function"))
        try:
            function(self, self.record)
        except Exception as error:  # code of the user
            self.failure = self.failure or f"{name}: {type(error).__name__}: {error}"


class _TruthLog:
    """The true state of the robot, as channels `simulation/...`."""

    def __init__(self, run: SimulatedRun):
        self._simulation = simulation = run.simulation
        self._model = simulation.kinematics.twin()
        log = Logger("simulation")
        names = simulation.kinematics.dofs
        for title, array, unit in (
            ("position", simulation.q, "rad"),
            ("velocity", simulation.v, "rad/s"),
            ("torque", simulation.torque, "Nm"),
        ):
            log.add(f"joints/{title}", array, names, unit)
        self._base = np.zeros(5)
        self._center = np.zeros(3)
        self._power = np.zeros(1)
        log.add("base", self._base, ("x", "y", "z", "heading", "tilt"), ("m", "m", "m", "rad", "rad"))
        log.add("center_of_mass", self._center, ("x", "y", "z"), "m")
        log.add("power", self._power, ("joints",), "W")
        self._link = simulation.kinematics.base_link if simulation.floating else None
        self._actuated = slice(6 if simulation.floating else 0, None)
        self.sources = log.sources

    def take(self, time: float) -> None:
        """Bring the numbers up to date, whatever the time [s]."""
        simulation = self._simulation
        self._model.update(simulation.q)
        self._center[:] = self._model.center_of_mass
        self._power[0] = np.abs(simulation.torque * simulation.v)[self._actuated].sum()
        if self._link is None:
            return
        now = simulation.state.now
        rotation = now.rotation(self._link)
        self._base[:3] = now.position(self._link)
        # the heading without its revolutions, as it is nearest to the one before
        heading = math.atan2(rotation[1, 0], rotation[0, 0])
        self._base[3] = heading + math.tau * round((float(self._base[3]) - heading) / math.tau)
        self._base[4] = math.acos(min(1.0, max(-1.0, float(rotation[2, 2]))))


def configurations_of(record: StudyRecord, changes: YamlNode | None) -> list[Configuration]:
    """Load the configurations of a study's plugins: pairs of plugin and configuration, or a shared configuration.

    Raises:
        SolferError: One is wrong. SolferErrors: Several mistakes.
    """
    registry = Registry()
    file = str(record.configuration.location)
    known = module_names(file)
    loaded: list[Configuration] = []
    for index, entry in enumerate(record.plugins):
        plugin, _, name = entry.partition("::")
        try:
            registry.require(plugin, known)
            name = name or (plugin if plugin in known else registry.configuration(plugin))
            if is_shared(name, Layers(file, Problems()).module(name)):
                loaded.append(load_shared(file, name, default=registry.configuration, system="SM", over=changes))
            else:
                configuration = load(file, name, system="SM", over=changes)
                registry.find(plugin, configuration.module.class_)
                loaded.append((plugin, configuration))
        except SolferError as error:
            raise error.at(record.where("plugins", index)) from None
    return loaded


def function_of(name: str, where: str) -> Callable[..., Any]:
    """Find a function `package.module:function`.

    Raises:
        ComponentError: There is none.
    """
    module, _, function = name.partition(":")
    try:
        found = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise ComponentError(
            f"there is no function '{name}': {error}", where=where, expected="`package.module:function` on PYTHONPATH"
        ) from None
    return found


def listed(loaded: Iterable[Configuration]) -> Iterator[tuple[str, config.Configuration]]:
    """Yield each plugin with its configuration, also those of shared plugins."""
    for each in loaded:
        if isinstance(each, SharedConfiguration):
            yield from ((plugin.plugin, plugin.configuration) for plugin in each.plugins)
        else:
            yield each


def check_tags(loaded: Iterable[Configuration]) -> None:
    """Check the own tags of all plugins.

    Raises:
        SolferError: One does not fit. SolferErrors: Several mistakes.
    """
    registry = Registry()
    for plugin, configuration in listed(loaded):
        tags = registry.find(plugin, configuration.module.class_).component.Tags
        if tags is not None:
            configuration.tags(tags)


def rehearse(record: StudyRecord) -> None:
    """Generate all plugins of a study without connecting them, which finds all mistakes, and loads what they need.

    Raises:
        SolferError: A plugin cannot be made. SolferErrors: Several mistakes.
    """
    registry = Registry()
    bundle = bundle_of(record.simulation, 0)
    srdf: Any = None if bundle.srdf is None else bundle.srdf.location
    files = RobotFiles(bundle.urdf.location, srdf)
    for plugin, configuration in listed(configurations_of(record, None)):
        declared(configuration, registry.find(plugin, configuration.module.class_), files)
