"""The life of a plugin in the RT layer."""

import enum
import logging
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from solfer.errors import described, located

logger = logging.getLogger(__name__)


class PluginState(enum.IntEnum):
    """State of a plugin's life.

    CONFIGURED: made from its configuration. INITIALIZED: admitted by the executor, not started yet. STARTING: waits for
    feedback or joints, then blends in from the measured state. RUNNING. STOPPING: the robot is at rest, the joints are
    being released. STOPPED. ABORTED: it failed, was too slow or was aborted by request; the robot holds, and it may be
    started again. FAULT: it could not even hold, or close; it does not run again.
    """

    CONFIGURED = 0
    INITIALIZED = 1
    STARTING = 2
    RUNNING = 3
    STOPPING = 4
    STOPPED = 5
    ABORTED = 6
    FAULT = 7


ACTIVE = frozenset({PluginState.STARTING, PluginState.RUNNING})
STARTABLE = frozenset({PluginState.INITIALIZED, PluginState.STOPPED, PluginState.ABORTED})
AT_REST = STARTABLE | {PluginState.CONFIGURED, PluginState.FAULT}


class Cyclic(Protocol):
    """Interface of a plugin that the RT layer needs (`solfer.plugins.Plugin`)."""

    rate: float
    robot: Any
    timing: Any
    outputs: Any

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def running(self) -> bool:
        """Whether its component runs."""

    @property
    def released(self) -> bool:
        """Whether it has given its joints back."""

    def cycle(self) -> None:
        """Make one control cycle."""

    def health(self) -> tuple[int, str]:
        """Return the level and the summary of its health report."""

    def stop(self) -> None:
        """Stop its component and come to rest."""

    def abort(self) -> None:
        """Hold at once, without asking its component."""

    def restart(self) -> None:
        """Start anew after a stop or an abort."""

    def close(self) -> None:
        """Release what it holds."""

    def blend_in(self, shortest: float, /) -> None:
        """Take at least `shortest` [s] to blend its commands in at a start."""


class ManagedPlugin:
    """A plugin and its life. None of its methods raises: any exception of the plugin ends its run.

    Requests to end the process come by a signal, which raises nothing here (`process.ProcessEnd`): a SystemExit or a
    KeyboardInterrupt is a component's own.

    Args:
        plugin: The plugin.
        blend: Shortest time in which its commands blend in at each start [s].

    Attributes:
        state: State of its life.
        reason: Why it is in this state, where that is not plain; else empty.
        starts, aborts: How often it was started and aborted.
        claims: Its commands: controller, field and joint of each value.
        changed: Called after each change of state or reason.
    """

    def __init__(self, plugin: Cyclic, blend: float = 0.0):
        self.plugin, self.state, self.reason = plugin, PluginState.CONFIGURED, ""
        self.starts = self.aborts = 0
        self.claims = frozenset(
            (pipe.name, field, joint)
            for pipe in plugin.outputs.commanding
            for field, _ in pipe.fields
            for joint in pipe.sent.names
        )
        self.changed: Callable[[ManagedPlugin], None] = lambda _: None
        self._before: tuple[ManagedPlugin, ...] = ()
        plugin.blend_in(blend)

    @property
    def name(self) -> str:
        """Name of the plugin."""
        return self.plugin.name

    @property
    def active(self) -> bool:
        """Whether it starts or runs."""
        return self.state in ACTIVE

    @property
    def at_rest(self) -> bool:
        """Whether it sends no commands."""
        return self.state in AT_REST

    def initialize(self) -> None:
        """Get ready to be started; sends nothing."""
        self._try(self.plugin.stop, PluginState.INITIALIZED)

    def start(self, after: Sequence["ManagedPlugin"] = ()) -> None:
        """Start as soon as the plugins of `after` are at rest."""
        self.starts += 1
        self._before = tuple(after)
        self._go(PluginState.STARTING)
        if not self._before:
            self._try(self.plugin.restart, PluginState.STARTING)

    def stop(self) -> None:
        """Bring the robot to rest, and release the joints."""
        self._before = ()
        self._try(self.plugin.stop, PluginState.STOPPING)

    def abort(self, reason: str) -> None:
        """Hold at once, without calling the component."""
        self.aborts += 1
        self._before = ()
        logger.error("%s is aborted: %s", self.name, reason)
        try:
            self.plugin.abort()
        except BaseException as error:
            logger.exception("%s cannot hold", self.name)
            self._go(PluginState.FAULT, f"{reason}; and it cannot hold: {described(error)}")
        else:
            self._go(PluginState.ABORTED, reason)

    def close(self) -> None:
        """Stop if it is active, then release its resources."""
        if self.active:
            self.stop()
        try:
            self.plugin.close()
        except BaseException as error:
            logger.exception("%s cannot be closed", self.name)
            self._go(PluginState.FAULT, f"it cannot be closed: {located(error)}")

    def cycle(self) -> None:
        """Run one control cycle; a plugin that does not run only answers calls."""
        if self._before:
            if not all(other.at_rest for other in self._before):
                return
            self._before = ()
            self._try(self.plugin.restart, PluginState.STARTING)
        try:
            self.plugin.cycle()
        except BaseException as error:
            self.abort(located(error))
            return
        if self.state is PluginState.RUNNING:
            if not self.plugin.running:
                self._go(PluginState.STARTING, self.plugin.health()[1])
        elif self.state is PluginState.STARTING:
            if self.plugin.running and not self.plugin.outputs.blending:
                self._go(PluginState.RUNNING)
        elif self.state is PluginState.STOPPING and self.plugin.released:
            self._go(PluginState.STOPPED)

    def _try(self, step: Callable[[], None], state: PluginState) -> None:
        """Run a step to another state; abort if it fails."""
        try:
            step()
        except BaseException as error:
            self.abort(located(error))
        else:
            self._go(state)

    def _go(self, state: PluginState, reason: str = "") -> None:
        if state is not self.state or reason != self.reason:
            self.state, self.reason = state, reason
            self.changed(self)
