"""Joint positions that follow joint velocities, within the limits of the joints."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import SizeMismatch, TaskError
from solfer.model.view import RobotView
from solfer.numerics.blocks import BlockLayout, MemoryBlock
from solfer.numerics.bounds import velocity as velocity_bounds
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.numerics.compilation import cached, exact_part
from solfer.tasks.constraints import joint_bounds
from solfer.tasks.task import as_numbers


class ReferenceIntegrator:
    """Desired positions of the joints as the integral of their velocities, without wind-up.

    A velocity is limited to what a joint may do from where its reference is; what the limits take away is not made up
    for later. So a reference stays in its range, and leaves the end of it in the cycle in which the velocity turns
    round. With `lead` it also stays near the measured position: a joint that something holds leaves no error behind
    that grows with time. Null spaces know no limits: tasks whose joints are limited here are not fulfilled, those of a
    `QpHierarchy` with `position=robot.command.position` and the same bounds use other joints instead.

    Args:
        robot: The Robot; position and velocity of its desired state are written.
        period: Period T of the control cycle [s].
        bounds: Bounds of the velocities; default: `joint_bounds(robot, period)`.
        lead: Largest distance of a reference from the measured position, positive, one number or one a DoF [rad, m];
            inf where there is none.

    Attributes:
        period: Time by which the next cycle goes on [s].

    Raises:
        TaskError: The period or the lead is not positive.
        SizeMismatch: Bounds or lead are of another robot's size.
    """

    def __init__(self, robot: RobotView, period: float, bounds: VelocityBounds | None = None, lead: ArrayLike = np.inf):
        where = f"reference integrator of '{robot.name}'"
        if not 0.0 < period < np.inf:
            raise TaskError(f"a period of {period:g} s", where=where, expected="a positive number")
        size = robot.kinematics.size
        lead = as_numbers(lead, "lead", where)
        self._bounds = bounds = joint_bounds(robot, period) if bounds is None else bounds
        for what, array in (("a lead", lead), ("bounds", bounds.lower)):
            if array.shape != (size,) and (array is not lead or lead.shape != ()):
                raise SizeMismatch(f"{what} of shape {array.shape} for {size} DoFs", where=where)
        if not (lead > 0.0).all():
            raise TaskError(f"a lead of {lead.tolist()}", where=where, expected="positive numbers")
        self._state = robot.state
        self._command = robot.command
        self.period = period
        self._block = MemoryBlock(
            INTEGRATION,
            size=size,
            has_lead=bool(np.isfinite(lead).any()),
            lead=np.full(size, lead),
            rate=bounds.rate,
            limits=bounds.limits,
            lower_position=bounds.lower_position,
            upper_position=bounds.upper_position,
            measured=robot.state.position,
            position=robot.command.position,
            velocity=robot.command.velocity,
        )

    def set_period(self, period: float) -> None:
        """Set the time by which the next cycle goes on [s]."""
        self.period = period
        self._bounds.set_period(period)

    def start(self, position: np.ndarray | None = None) -> None:
        """Begin at rest.

        Args:
            position: Where joints are, or next to it within their ranges, shape (n,) [rad, m]; None: as measured.
        """
        self._command.position[:] = self._state.position if position is None else position
        self._command.velocity[:] = 0.0
        self._stay_inside()

    def update(self, velocity: np.ndarray) -> np.ndarray:
        """Write the desired velocities and positions of this cycle.

        Args:
            velocity: Joint velocities to follow, shape (n,) [rad/s, m/s].

        Returns:
            The desired velocities within all limits, shape (n,): those of the Robot's desired state, live.
        """
        _integrate(self._block.address, velocity, self.period)
        return self._command.velocity

    def _stay_inside(self) -> None:
        """Bring references into their ranges, also by what rounding adds."""
        position = self._command.position
        bounds = self._bounds
        np.maximum(position, bounds.lower_position, out=position)
        np.minimum(position, bounds.upper_position, out=position)


INTEGRATION = BlockLayout(
    "Integration",
    size=int,
    has_lead=bool,
    rate=(float, 1),
    lead=(float, "size"),
    # lower and upper bounds of velocities, and speeds
    limits=(float, 3, "size"),
    lower_position=(float, "size"),
    upper_position=(float, "size"),
    measured=(float, "size"),
    # desired
    position=(float, "size"),
    velocity=(float, "size"),
)
"""What `_integrate_all` reads and writes."""

_integration_at = INTEGRATION.at
_bound = exact_part(velocity_bounds.bound_velocities)


def _integrate_all(address, velocity, period):
    """See `ReferenceIntegrator.update`; with a lead, velocities let references stay near the measured positions.

    They are not faster than the joint may go back; a NaN stays one.
    """
    block = _integration_at(address)
    position = block.position
    _bound(block.lower_position, block.upper_position, block.rate, block.limits, position)
    for k in range(block.size):
        low = block.limits[0, k]
        high = block.limits[1, k]
        desired = np.minimum(np.maximum(velocity[k], low), high)
        if block.has_lead:
            most = (block.lead[k] + block.measured[k] - position[k]) / period
            least = (-block.lead[k] + block.measured[k] - position[k]) / period
            desired = np.minimum(desired, np.maximum(most, low))
            desired = np.maximum(desired, np.minimum(least, high))
        block.velocity[k] = desired
        desired = position[k] + desired * period
        position[k] = np.minimum(np.maximum(desired, block.lower_position[k]), block.upper_position[k])


_integrate = cached("void(int64, float64[::1], float64)", _integrate_all, sources=[Path(velocity_bounds.__file__)])
