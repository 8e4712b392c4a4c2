"""Checks the measurement with which a plugin would start, as XBotCore does (row 2 of Table 2 of the paper)."""

from collections.abc import Sequence

import numpy as np

from solfer.config.records.pipes import LimitsRecord
from solfer.errors import OutOfLimits
from solfer.model import State
from solfer.pipes.state_field import interface_of
from solfer.robot import Robot


class StartLimits:
    """Limits of the joints that a feedback measures, each wider by a tolerance.

    An encoder that is not calibrated shows a posture that the robot cannot have: a plugin that started from it would
    drive joints against their stops.

    Args:
        pipe: Name of the pipe, for the error.
        record: The tolerances.
        robot: The Robot, with its limits.
        dofs: DoFs that the pipe measures, shape (k,).
        fields: Fields that it measures.
    """

    def __init__(self, pipe: str, record: LimitsRecord, robot: Robot, dofs: np.ndarray, fields: Sequence[str]):
        self._pipe, self._where = pipe, record.where("tolerance")
        self._dofs = np.array(dofs)
        self._joints = tuple(robot.dofs[dof] for dof in dofs)
        tolerance = record.tolerance
        turns = np.array([_turns(robot, joint) for joint in self._joints], dtype=bool)
        wider = {
            "position": np.where(turns, np.radians(tolerance.position), 0.0),
            "velocity": np.where(turns, np.radians(tolerance.velocity), 0.0),
            "effort": np.full(len(turns), tolerance.torque),
        }
        self._units = ["rad" if turning else "m" for turning in turns]
        fields = [field for field in fields if field in wider]
        self._checked = [(field, *self._interval(robot, field), wider[field]) for field in fields]

    def check(self, state: State) -> None:
        """Check the measured values of a State.

        Raises:
            OutOfLimits: A value is further outside than its tolerance; the first one in the order of the pipe.
        """
        for field, lower, upper, tolerance in self._checked:
            values = state[interface_of(field)][self._dofs]
            wrong = np.flatnonzero((values < lower - tolerance) | (values > upper + tolerance))
            if len(wrong):
                worst = wrong[0]
                raise self._error(
                    field, worst, values[worst], lower=lower[worst], upper=upper[worst], tolerance=tolerance[worst]
                )

    def _interval(self, robot: Robot, field: str) -> tuple[np.ndarray, np.ndarray]:
        interface = interface_of(field)
        return robot.lower_limits[interface][self._dofs], robot.upper_limits[interface][self._dofs]

    def _error(
        self, field: str, index: int, value: float, lower: float, upper: float, *, tolerance: float
    ) -> OutOfLimits:
        unit = self._units[index]
        unit = {"position": unit, "velocity": f"{unit}/s", "effort": "Nm" if unit == "rad" else "N"}[field]
        side, limit = ("lower", lower) if value < lower else ("upper", upper)
        return OutOfLimits(
            f"feedback '{self._pipe}': the first {field} of joint '{self._joints[index]}' is {value:.3f} {unit}, "
            f"beyond its {side} limit {limit:.3f} {unit}",
            where=self._where,
            expected=f"at most {tolerance:.3f} {unit} beyond it; else look at its encoder and calibration",
        )


def _turns(robot: Robot, dof: str) -> bool:
    joint = robot.description.joints.get(dof)
    return joint is None or joint.type != "prismatic"
