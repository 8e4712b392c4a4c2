"""Numbers over time, for plots."""

from collections.abc import Mapping
from typing import Protocol

from solfer.transport import Middleware
from solfer.transport.middleware import HealthReport
from solfer_tools.scene import SceneState


class PlottedColumns(Protocol):
    """Columns of which plots take samples."""

    def names(self) -> list[str]:
        """List all columns."""

    def value(self, name: str) -> float:
        """Return the newest number of a column; NaN: there is none."""


class LiveColumns:
    """Columns of what is published: joints, centre of mass, forces, and figures of plugins.

    Args:
        middleware: Carries it.
    """

    def __init__(self, middleware: Middleware):
        self._joints = middleware.reader("joint_states", "sensor_msgs/JointState")
        self._values: dict[str, float] = {}

    def update(self, state: SceneState | None, reports: Mapping[str, HealthReport]) -> None:
        """Take what is new."""
        values = self._values
        if state is not None:
            self._take_scene(state)
        for part, report in reports.items():
            values.update(
                {f"{part}/{name}": float(value) for name, value in report.values.items() if not isinstance(value, str)}
            )

    def _take_scene(self, state: SceneState) -> None:
        values = self._values
        self._joints.read()
        message = self._joints.message
        for field, unit in (("position", "rad"), ("velocity", "rad/s"), ("effort", "Nm")):
            numbers = getattr(message, field, None)  # another reader may have the first message earlier
            if numbers is not None:
                named = zip(message.names, numbers.tolist(), strict=True)
                values.update({f"{field}/{name} [{unit}]": value for name, value in named})
        for axis, value in zip("xyz", state.center.tolist(), strict=True):
            values[f"centre of mass/{axis} [m]"] = value
        for force in state.forces:
            values[f"vertical force/{force.contact} [N]"] = float(force.force[2])

    def names(self) -> list[str]:
        """See `PlottedColumns`."""
        return sorted(self._values)

    def value(self, name: str) -> float:
        """See `PlottedColumns`."""
        return self._values.get(name, float("nan"))
