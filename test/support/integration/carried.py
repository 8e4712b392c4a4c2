"""CENTAURO that is carried by its torques, with what it may hold, and arms where a test wants them."""

import re
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from support.integration.world import ROBOT, World

from solfer.config.records.sources import FileRecord
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bundle import load_bundle, read_bundle

HANDS = ("arm1_7", "arm2_7")
PAYLOAD = """<link name="payload"><inertial><origin xyz="0 0 0"/><mass value="{mass}"/>
  <inertia ixx="{spin}" iyy="{spin}" izz="{spin}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="grip" type="fixed"><parent link="{hand}"/><child link="payload"/><origin xyz="0 0 -0.08"/></joint>
</robot>"""


def _without_friction(folder: Path) -> FileRecord:
    """Write the robot's actuators without friction in the motors."""
    file = folder / "actuators.yaml"
    file.write_text(re.sub(r"\b(Bm?): [^,]+", r"\1: 0.0", (ROBOT / "actuators.yaml").read_text()))
    return FileRecord(file=str(file))


class CarriedWorld(World):
    """A `World` whose robot may hold something that its model knows.

    Args:
        payload: Mass in the first hand [kg].
        friction: Whether the motors have friction.
        joints: Where joints are at the beginning, beside those of the robot's first state [rad].
    """

    def __init__(self, payload: float = 0.0, friction: bool = True, joints: Mapping[str, float] | None = None):
        self._friction, self._joints, self.urdf = friction, dict(joints or {}), (ROBOT / "centauro.urdf").read_text()
        if payload:
            held = PAYLOAD.format(mass=payload, spin=payload * 0.05**2, hand=HANDS[0])
            self.urdf = held.join(self.urdf.rsplit("</robot>", 1))
        super().__init__()
        self.bus.parameters["/robot_description"] = self.urdf
        self.heights: list[float] = []
        self.bus.every(0.001, lambda: self.heights.append(float(self.simulation.q[2])))

    def offer(self, middleware):
        """See `World.offer`."""
        record = read_bundle(ROBOT / "robot.yaml")
        with tempfile.TemporaryDirectory() as folder:
            if not self._friction:
                record = record.model_copy(update={"actuators": _without_friction(Path(folder))})
            bundle = load_bundle(record, self.urdf)
        if self._joints:
            drawn = {**bundle.states[bundle.start], **self._joints}
            bundle = replace(bundle, states={**bundle.states, "drawn": drawn}, start="drawn")
        simulation = Simulation(bundle)
        return simulation, SimulationServer(simulation, middleware)

    def sag(self) -> float:
        """Return how far the base has been below, or above, where it was when its heights were cleared [m]."""
        return max(abs(height - self.heights[0]) for height in self.heights)

    def hand(self, index: int = 0) -> np.ndarray:
        """Return the place of a hand in the world, shape (3,) [m]."""
        return self.simulation.state.now.position(HANDS[index]).copy()

    def push_aside(self, distance: float, direction: np.ndarray, force: float = 8.0, longest: float = 5.0) -> float:
        """Push the first hand until it has gone `distance` [m]; return how far it has gone."""
        begin, steps = self.hand(), round(longest / 0.02)
        for _ in range(steps):
            gone = float(np.linalg.norm(self.hand() - begin))
            if gone >= distance:
                break
            self.simulation.pushes.add(HANDS[0], force * direction, (0.0, 0.0, 0.0), 0.02)
            self.run(0.02)
        return gone
