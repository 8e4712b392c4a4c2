"""A component's part of a cycle of its plugin."""

from solfer.components import Component
from solfer.plugins.base_jumps import BaseJumps
from solfer.plugins.measured_guard import MeasuredGuard
from solfer.plugins.timing.robot_time import RobotTime
from solfer.recording.log import Logger
from solfer.transport.declared import Publications


class ComponentCycle:
    """What a component needs for a cycle: its dynamics and its time, jumps of its base, its failures, and what it logs.

    Args:
        component: The component.
        robot_time: Its time.
        jumps: Finds jumps of the base; None: it has no references in the world.
        guard: Keeps what it does to its Robot, if it fails, away from others; None: it is not shared.
        publications: What it declares to publish; None: nothing.

    Attributes:
        robot_time, jumps, guard: See above; its plugin asks them in each cycle.
        dynamics: What it requests of the Robot's dynamics; None: nothing.
        publications: See above; its loop counts them down.
        logger: Where the component logs its cycles; None: it logs nothing by itself.
    """

    def __init__(
        self,
        component: Component,
        robot_time: RobotTime,
        jumps: BaseJumps | None,
        guard: MeasuredGuard | None,
        publications: Publications | None,
    ):
        self.robot_time = robot_time
        self._component = component
        self.jumps = jumps
        self.guard = guard
        # made before the first cycle: importing its modules takes a while
        self.dynamics = component.model.dynamics.manager if component.dynamics else None
        self.publications = publications or Publications()
        self.logger: Logger | None = None
        self._began = 0.0  # [s]

    def start(self, now: float) -> None:
        """Begin at the time `now` [s], after the component's `init`."""
        self._began = now
        self.robot_time.restart(now)

    def start_log(self, logger: Logger) -> None:
        """Let the component declare what it logs; from now on its `log`, if it has one, is called by `log`."""
        self._component.start_log(logger)
        self.logger = logger if type(self._component).log is not Component.log else None

    def forget_jumps(self) -> None:
        """Begin with the base where it is."""
        if self.jumps is not None:
            self.jumps.restart()

    def log(self, now: float) -> None:
        """Let the component log the cycle of the time `now` [s]."""
        if self.logger is not None:
            self._component.log(self.logger, now - self._began)

    def figures(self) -> dict[str, float | str]:
        """Return figures for health reports."""
        return {} if self.jumps is None else {"jumps of the base": self.jumps.count}
