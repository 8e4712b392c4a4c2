"""The observations of a network, gathered of a Robot."""

import math

import numpy as np

from solfer.components.policy.contract import PolicyContract, whole_width, width
from solfer.components.policy.tags import TERMS
from solfer.numerics.base_chart import BaseChart
from solfer.numerics.twist_transport import BaseKinematics
from solfer.robot import Robot

SLOWEST = 0.01
"""Commanded velocity below which a gait rests [m/s, rad/s]."""


class StepNumbers:
    """All that a network can observe in one step, before order and scale.

    Angular velocity [rad/s], direction of gravity and linear velocity [m/s] of the base are in its own axes, joints
    [rad, m] relative to the default pose.

    Args:
        robot: The Robot.
        contract: The contract.

    Attributes:
        all: The numbers of all terms, one term behind the other.
        of: Those of each term by its name; live.
        order: Places in `all` of the numbers of one step, in the order of the contract, shape (w,).
    """

    def __init__(self, robot: Robot, contract: PolicyContract):
        self._state = robot.state
        self._contract = contract
        chart = robot.kinematics.base
        self._base = BaseKinematics(chart if chart is not None else BaseChart())
        self._down = robot.gravity / max(float(np.linalg.norm(robot.gravity)), 1e-9)
        phases = [
            (each, term.period, math.nan if term.rest is None else term.rest)
            for term in contract.terms
            if term.term == "phase"
            for each in term.offsets
        ]
        self._offsets, self._periods, self._rest = np.array(phases, dtype=float).reshape(-1, 3).T.copy()
        self._rests = ~np.isnan(self._rest)
        self._starts = np.zeros(len(phases))  # of the gaits [s]
        self._has_rested = True
        self._angles = np.zeros(len(phases))
        count = len(contract.joints)
        sizes = {term: count if term.startswith(("joint", "last")) else 3 for term in TERMS}
        sizes["phase"] = 2 * len(phases)
        starts = dict(zip(TERMS, np.cumsum([0, *sizes.values()])[:-1].tolist(), strict=True))
        self.all = np.zeros(sum(sizes.values()))
        self.of = {term: self.all[start : start + sizes[term]] for term, start in starts.items()}
        self.order = self._ordered(starts)

    def _ordered(self, starts: dict[str, int]) -> np.ndarray:
        """Return the places of the numbers of one step; of a phase the sines, then the cosines."""
        places = []
        before = 0  # phases of earlier terms
        for term in self._contract.terms:
            found = starts[term.term] + np.arange(whole_width(term, len(self._contract.joints)))
            if term.term == "phase":
                found += before
                found[len(term.offsets) :] += len(self._angles) - len(term.offsets)
                before += len(term.offsets)
            places.append(found if term.pick is None else found[list(term.pick)])
        return np.concatenate(places)

    def measure_base(self) -> None:
        """Measure how the base is turned, and moves."""
        base = self._base
        base.update(self._state.position, self._state.velocity)
        # a row times the rotation from the base to the world is the vector in axes of the base
        np.dot(base.velocity[3:], base.rotation, out=self.of["angular_velocity"])
        np.dot(base.velocity[:3], base.rotation, out=self.of["linear_velocity"])
        np.dot(self._down, base.rotation, out=self.of["projected_gravity"])

    def measure_joints(self) -> None:
        """Measure the joints."""
        contract = self._contract
        position = self.of["joint_position"]
        np.take(self._state.position, contract.dofs, out=position, mode="clip")
        position -= contract.default
        np.take(self._state.velocity, contract.dofs, out=self.of["joint_velocity"], mode="clip")

    def set_time(self, time: float) -> None:
        """Write the phases `time` after the start [s]."""
        angles = self._angles
        phase = self.of["phase"]
        is_at_rest = self._is_at_rest()
        if not is_at_rest and self._has_rested:
            np.copyto(self._starts, time, where=self._rests)
        self._has_rested = is_at_rest
        np.subtract(time, self._starts, out=angles)
        angles /= self._periods
        angles += self._offsets
        if is_at_rest:
            np.copyto(angles, self._rest, where=self._rests)
        angles *= 2.0 * math.pi
        np.sin(angles, out=phase[: len(angles)])
        np.cos(angles, out=phase[len(angles) :])

    def reset(self) -> None:
        """Forget commands, the last action, and when gaits began."""
        self.all[:] = 0.0
        self._has_rested = True

    def _is_at_rest(self) -> bool:
        x, y, turn = self.of["commands"].tolist()
        return math.hypot(x, y) < SLOWEST and abs(turn) < SLOWEST


class Observations:
    """Terms in the order of a contract, with their scales, bounds and histories.

    A history begins with copies of its first step.

    Args:
        robot: The Robot.
        contract: The contract.
        out: Where the observations are written, shape (n,) float32.

    Attributes:
        commands: Commanded velocity of the base in its own axes: x, y [m/s] and yaw rate [rad/s], shape (3,); live.
        last_action: Actions of the last step, shape (m,); live.
    """

    def __init__(self, robot: Robot, contract: PolicyContract, out: np.ndarray):
        self._out = out
        self._numbers = numbers = StepNumbers(robot, contract)
        self.commands = numbers.of["commands"]
        self.last_action = numbers.of["last_action"]
        sizes = [width(term, len(contract.joints)) for term in contract.terms]
        terms = list(zip(contract.terms, sizes, strict=True))
        self._scale = np.concatenate([np.broadcast_to(term.scale, size) for term, size in terms])
        self._upper = np.concatenate([np.full(size, term.clip) for term, size in terms])
        self._lower = -self._upper
        total = sum(sizes)
        longest = max(term.history for term in contract.terms)
        self._history = np.zeros(longest * total)
        self._step = self._history[-total:]
        places = np.arange(longest * total).reshape(longest, total)
        begins = np.cumsum([0, *sizes])
        if contract.history_order == "terms":
            parts = [
                places[-term.history :, begin : begin + size]
                for (term, size), begin in zip(terms, begins[:-1], strict=True)
            ]
        else:  # all terms have one history
            parts = [places if contract.history_order == "oldest_step_first" else places[::-1]]
        self._picked = np.concatenate([part.ravel() for part in parts])
        self._result = np.zeros(len(self._picked))
        self.reset()

    @property
    def tilt(self) -> float:
        """Angle between the vertical and the z axis of the base as of the last `measure_base` [rad]."""
        return math.acos(max(-1.0, min(1.0, -self._numbers.of["projected_gravity"].item(2))))

    def reset(self) -> None:
        """Forget histories, commands and the last action."""
        self._numbers.reset()
        self._history[:] = math.nan

    def measure_base(self) -> None:
        """Measure how the base is turned, and moves; to be called before `tilt` and `update`."""
        self._numbers.measure_base()

    def update(self, time: float) -> None:
        """Write the observations of a step, `time` after the start [s]."""
        numbers = self._numbers
        numbers.measure_joints()
        numbers.set_time(time)
        step = self._step
        history = self._history
        history[: -len(step)] = history[len(step) :]
        np.take(numbers.all, numbers.order, out=step, mode="clip")
        step *= self._scale
        np.minimum(step, self._upper, out=step)
        np.maximum(step, self._lower, out=step)
        if math.isnan(history.item(0)):
            history.reshape(-1, len(step))[:] = step
        np.take(history, self._picked, out=self._result, mode="clip")
        self._out[:] = self._result
