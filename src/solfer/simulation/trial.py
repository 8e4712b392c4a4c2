"""The first second of a robot in the simulation, which shows whether its files describe one that stands or holds."""

import math
from contextlib import closing
from pathlib import Path

import numpy as np

from solfer.errors import SimulationError
from solfer.simulation.physics import STEP
from solfer.simulation.robot_body.placement import sunk
from solfer.simulation.simulation import Simulation


def simulate_for_a_second(bundle: Path) -> str:
    """Simulate a robot without commands; return how it begins wrong or does not keep its posture, or "".

    Args:
        bundle: Its bundle, such as config/robots/centauro/robot.yaml.

    Raises:
        SolferError: A file of the bundle is wrong, or the robot cannot be simulated.
    """
    sag = 0.1  # [rad, m], by which a joint may give way under the robot's weight
    fallen = math.cos(math.radians(20.0))
    with closing(Simulation.from_file(bundle)) as simulation:
        inside = sunk(simulation.body, simulation.world)
        begin = simulation.q.copy()
        for _ in range(round(1.0 / STEP)):
            simulation.step()
        if not np.isfinite(simulation.q).all():
            raise SimulationError(
                "the motion of the robot becomes infinite within 1 s",
                where=str(bundle),
                expected="gains, masses and inertias that fit each other",
            )
        if inside:
            return inside
        base = simulation.kinematics.base_link
        if base is not None and simulation.state.now.rotation(base)[2, 2] < fallen:
            return "the robot falls within 1 s without commands"
        joints = slice(6 if simulation.floating else 0, None)
        moved = np.abs(simulation.q - begin)[joints]
        names = simulation.kinematics.dofs[joints]
        weak = int(moved.argmax()) if len(moved) else 0
        if len(moved) and moved[weak] > sag:
            return f"joint '{names[weak]}' gives way by {moved[weak]:.2g} within 1 s without commands"
    return ""
