"""The life of a plugin in the RT layer."""

import enum
import logging
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from solfer.errors import SolferError

logger = logging.getLogger(__name__)


class Stage(enum.IntEnum):
    """Where a plugin is in its life.

    CONFIGURED: made of its configuration. INITIALIZED: admitted by the executor, not started yet. STARTING: waits for
    feedback or joints, then blends in from the measured state. RUNNING. STOPPING: the robot is at rest, the joints are
    being given back. STOPPED. ABORTED: it failed, was too slow or was told to; the robot holds, and it may be started
    again. FAULT: it could not even hold, or close; it does not run again.
    """

    CONFIGURED = 0
    INITIALIZED = 1
    STARTING = 2
    RUNNING = 3
    STOPPING = 4
    STOPPED = 5
    ABORTED = 6
    FAULT = 7


ACTIVE = frozenset({Stage.STARTING, Stage.RUNNING})
STARTABLE = frozenset({Stage.INITIALIZED, Stage.STOPPED, Stage.ABORTED})
AT_REST = STARTABLE | {Stage.CONFIGURED, Stage.FAULT}


class Cyclic(Protocol):
    """What the RT layer needs of a plugin (`solfer.plugins.Plugin`)."""

    name: str
    rate: float
    robot: Any
    stages: Any
    outputs: Any
    running: bool
    released: bool
    cycle: Callable[[], None]
    health: Callable[[], tuple[int, str]]
    stop: Callable[[], None]
    abort: Callable[[], None]
    restart: Callable[[], None]
    close: Callable[[], None]
    blend_in: Callable[[float], None]


class Managed:
    """A plugin and its life. None of its methods raises: what the plugin raises ends its run.

    Args:
        plugin: The plugin.
        blend: Shortest time in which its commands blend in at each start [s].

    Attributes:
        stage: Where it is in its life.
        reason: Why it is there, where that is not plain; else empty.
        starts, aborts: How often it was started and aborted.
        claims: What it commands: controller, field and joint of each number.
        changed: Called after each change of the stage.
    """

    def __init__(self, plugin: Cyclic, blend: float = 0.0):
        self.plugin, self.stage, self.reason = plugin, Stage.CONFIGURED, ""
        self.starts = self.aborts = 0
        self.claims = frozenset((pipe.name, field, joint) for pipe in plugin.outputs.commanding
                                for field, _ in pipe.fields for joint in pipe.sent.names)
        self.changed: Callable[[Managed], None] = lambda _: None
        self._before: tuple[Managed, ...] = ()
        plugin.blend_in(blend)

    @property
    def name(self) -> str:
        """Name of the plugin."""
        return self.plugin.name

    @property
    def active(self) -> bool:
        """Whether it starts or runs."""
        return self.stage in ACTIVE

    @property
    def at_rest(self) -> bool:
        """Whether it does not command anything."""
        return self.stage in AT_REST

    def initialize(self) -> None:
        """Be ready to be started; nothing is sent."""
        self._try(self.plugin.stop, Stage.INITIALIZED)

    def start(self, after: Sequence["Managed"] = ()) -> None:
        """Start as soon as those of `after` are at rest."""
        self.starts += 1
        self._before = tuple(after)
        self._go(Stage.STARTING)
        if not self._before:
            self._try(self.plugin.restart, Stage.STARTING)

    def stop(self) -> None:
        """Bring the robot to rest, and give the joints back."""
        self._before = ()
        self._try(self.plugin.stop, Stage.STOPPING)

    def abort(self, reason: str) -> None:
        """Hold at once, without asking the component."""
        self.aborts += 1
        self._before = ()
        logger.error("%s is aborted: %s", self.name, reason)
        try:
            self.plugin.abort()
        except Exception as error:
            logger.exception("%s cannot hold", self.name)
            self._go(Stage.FAULT, f"{reason}; and it cannot hold: {described(error)}")
        else:
            self._go(Stage.ABORTED, reason)

    def close(self) -> None:
        """Stop if it is active, then release what it holds."""
        if self.active:
            self.stop()
        try:
            self.plugin.close()
        except Exception as error:
            logger.exception("%s cannot be closed", self.name)
            self._go(Stage.FAULT, f"it cannot be closed: {described(error)}")

    def cycle(self) -> None:
        """One control cycle; one that does not run answers calls only."""
        if self._before:
            if not all(other.at_rest for other in self._before):
                return
            self._before = ()
            self._try(self.plugin.restart, Stage.STARTING)
        try:
            self.plugin.cycle()
        except Exception as error:
            self.abort(described(error))
            return
        if self.stage is Stage.RUNNING:
            if not self.plugin.running:
                self._go(Stage.STARTING, self.plugin.health()[1])
        elif self.stage is Stage.STARTING:
            if self.plugin.running and not self.plugin.outputs.blending:
                self._go(Stage.RUNNING)
        elif self.stage is Stage.STOPPING and self.plugin.released:
            self._go(Stage.STOPPED)

    def _try(self, step: Callable[[], None], stage: Stage) -> None:
        """Take a step to a stage; whoever fails is aborted."""
        try:
            step()
        except Exception as error:
            self.abort(described(error))
        else:
            self._go(stage)

    def _go(self, stage: Stage, reason: str = "") -> None:
        if stage is not self.stage or reason != self.reason:
            self.stage, self.reason = stage, reason
            self.changed(self)


def described(error: Exception) -> str:
    """What happened, in one line, for the operator."""
    return error.line if isinstance(error, SolferError) else f"{type(error).__name__}: {error}"
