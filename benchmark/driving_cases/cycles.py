"""What one cycle of the component costs in the model, without PyBullet and without a plugin."""

import gc
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from driving_cases.golden import CONFIG, CONTACTS, SRDF
from points import ROUNDS, URDF, unit

from solfer import Robot
from solfer.components.wheeled_motion import WheeledMotion
from solfer.config import load
from solfer.interfaces.geometry import Twist, Vector
from solfer.model import Description
from solfer.model.urdf.cut import cut

RATE, EVERY = 200.0, 10  # [Hz], cycles between two messages
MOTIONS = ((0.1, 0.03, 0.1), (-0.05, 0.1, -0.1))
"""Velocities that are sent, x, y [m/s] and the rate of the heading [rad/s]."""

TURNS = 300
"""Cycles after which the other motion is sent."""

WAYS: dict[str, dict[str, Any]] = {"default": {}, "original": {"law": "original"}}
"""What is measured, by tags."""


class Cycle:
    """The component on a robot that does what is commanded, driven by `cmd_vel`.

    Args:
        is_whole: Whether the Robot is the whole robot, or its lower body.
        tags: Tags that differ from the shipped ones.
    """

    def __init__(self, is_whole: bool, **tags: Any):
        text = URDF.read_text()
        part = text if is_whole else cut(Description.from_text(text), "torso_2", "lower")
        self._robot = robot = Robot.load(part, SRDF, contacts=CONTACTS, others=[URDF], name="centauro")
        dofs, values = robot.named_state("mammal_wide_straight")
        robot.state.position[dofs] = values
        robot.update()
        shipped = load(CONFIG, "wheeled_motion").tags(WheeledMotion.Tags)
        record = shipped.model_copy(update=tags).placed_as(shipped)
        self._component = WheeledMotion(robot, record, "wheeled_motion")
        self._component.set_rate(RATE)
        self._component.init()
        self._count = 0

    @property
    def dofs(self) -> int:
        """DoFs of the Robot."""
        return self._robot.size

    def move(self) -> None:
        """Let the robot be where it was commanded to be, and a message come now and then."""
        state, command, moved = self._robot.state, self._robot.command, self._component.moved
        if self._count:
            state.position[moved], state.velocity[moved] = command.position[moved], command.velocity[moved]
        if self._count % EVERY == 0:
            x, y, turn = MOTIONS[self._count // TURNS % 2]
            self._component.drive.receive(Twist(Vector(x, y), Vector(0.0, 0.0, turn)))
        self._count += 1

    def run(self) -> None:
        """Run a cycle."""
        self._robot.update()
        self._component.update()
        self._component.send()

    def stages(self, calls: int) -> dict[str, float]:
        """Measure the parts of a cycle; return the median of each [us]."""
        component, spent = self._component, dict[str, list[float]]()
        parts = {
            "kinematics": (self._robot, "update"),
            "rows": (component.stack, "update_jacobian"),
            "velocities": (component.tasks.descent, "update"),
        }
        whole = Stopwatch(self.run, spent.setdefault("rest", []))
        for name, (owner, method) in parts.items():
            setattr(owner, method, Stopwatch(getattr(owner, method), spent.setdefault(name, [])))
        for _ in range(calls):
            self.move()
            whole()
        for owner, method in parts.values():
            delattr(owner, method)
        medians = {name: float(np.median(times)) for name, times in spent.items()}
        medians["rest"] -= sum(medians[name] for name in parts)
        return medians


class Stopwatch:
    """A function whose calls are timed.

    Args:
        work: The function.
        times: Where the time of each call goes [us].
    """

    def __init__(self, work: Callable[..., Any], times: list[float]):
        self._work, self._times = work, times

    def __call__(self, *given: Any, **named: Any) -> Any:
        """Call the function."""
        begun = time.perf_counter_ns()
        result = self._work(*given, **named)
        self._times.append(1e-3 * (time.perf_counter_ns() - begun))
        return result


def cycles(calls: int) -> Iterator[dict[str, Any]]:
    """Measure cycles of all ways, on the lower body and on the whole robot, in turns; yield the figures of each."""
    made = {(way, whole): Cycle(whole, **WAYS[way]) for whole in (False, True) for way in WAYS}
    times: dict[tuple[str, bool], list[np.ndarray]] = {key: [] for key in made}
    units = []
    gc.collect()
    gc.disable()
    for _ in range(ROUNDS):
        units.append(unit(max(calls // ROUNDS, 20)))
        for key, cycle in made.items():
            times[key].append(_timed(cycle, max(calls // ROUNDS, 20)))
    gc.enable()
    one = float(np.median(units))
    for key, each in times.items():
        cycle = made[key]
        # other work on the machine comes and goes: each round counts alike
        median = float(np.median([np.median(part) / u for part, u in zip(each, units, strict=True)]))
        yield {
            "case": f"cycle, {key[0]}",
            "dofs": cycle.dofs,
            "cycle_p50": float(np.median([np.median(part) for part in each])),
            "cycle_p99": float(np.median([np.percentile(part, 99) for part in each])),
            "cycle_p50_u": median,
            "u": one,
            "stages": {name: round(value, 2) for name, value in cycle.stages(calls // ROUNDS).items()},
        }


def _timed(cycle: Cycle, calls: int) -> np.ndarray:
    """Return the time of each of some cycles [us]."""
    taken = np.zeros(calls)
    for index in range(calls):
        cycle.move()
        begun = time.perf_counter_ns()
        cycle.run()
        taken[index] = 1e-3 * (time.perf_counter_ns() - begun)
    return taken
