"""CENTAURO that is carried by its torques, with what it may hold, and arms where a test puts them."""

import re
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from support.integration.world import CONFIG, ROBOT, World, perfect

from solfer.config.records.sources import FileRecord
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bundle import load_bundle

HANDS = ("arm1_7", "arm2_7")
WRONG = 0.2
"""Largest error of masses and inertias, as a share of them."""
SOFT = "- {chain: arms, stiffness: 50, damping: 5}"
PAYLOAD = """<link name="payload"><inertial><origin xyz="0 0 0"/><mass value="{mass}"/>
  <inertia ixx="{spin}" iyy="{spin}" izz="{spin}" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="grip" type="fixed"><parent link="{hand}"/><child link="payload"/><origin xyz="0 0 -0.08"/></joint>
</robot>"""


def _without_friction(folder: Path) -> FileRecord:
    """Write the robot's actuators without friction in the motors."""
    file = folder / "actuators.yaml"
    file.write_text(re.sub(r"\b(Bm?): [^,]+", r"\1: 0.0", (ROBOT / "actuators.yaml").read_text()))
    return FileRecord(file=str(file))


def with_other_masses(urdf: str, share: float, seed: int) -> str:
    """Return a description with mass and inertia of each link times a factor drawn from 1 - share to 1 + share."""
    random = np.random.default_rng(seed)

    def scaled(block: re.Match[str]) -> str:
        factor = random.uniform(1.0 - share, 1.0 + share)
        number = r'((?:<mass value|i[xyz][xyz])=")([^"]+)"'
        return re.sub(number, lambda found: f'{found[1]}{factor * float(found[2]):.12g}"', block[0])

    return re.sub(r"<inertial>.*?</inertial>", scaled, urdf, flags=re.DOTALL)


def with_other_trunk(urdf: str, distance: float, seed: int, links: tuple[str, ...] = ("pelvis", "torso_2")) -> str:
    """Return a description in which the centres of mass of links are aside by a distance [m] in a drawn direction."""
    way = np.random.default_rng(1000 + seed).normal(size=3)
    way *= distance / np.linalg.norm(way)

    def moved(found: re.Match[str]) -> str:
        return f'{found[1]}{" ".join(map(str, np.array(found[2].split(), dtype=float) + way))}"'

    for link in links:
        urdf, count = re.subn(rf'(<link name="{link}">\s*<inertial>\s*<origin xyz=")([^"]+)"', moved, urdf)
        assert count == 1, link
    return urdf


def free_arms(folder):
    """Write the configuration with arms that have no stiffness."""
    for name in ("support", "robots"):
        (folder / name).symlink_to(CONFIG / name)
    text = (CONFIG / "centauro.yaml").read_text()
    assert text.count(SOFT) == 1
    file = folder / "centauro.yaml"
    file.write_text(text.replace(SOFT, "- {chain: arms, stiffness: 0, damping: 5}"))
    return file


class CarriedWorld(World):
    """A `World` whose robot may hold something that its model knows, and have other masses than its model.

    Args:
        payload: Mass in the first hand [kg].
        friction: Whether the motors have friction.
        joints: Where joints are at the beginning, beside those of the robot's first state [rad].
        wrong: Seed of masses and inertias that are up to 20 % wrong; None: they are those of the model.
    """

    def __init__(
        self,
        payload: float = 0.0,
        friction: bool = True,
        joints: Mapping[str, float] | None = None,
        wrong: int | None = None,
    ):
        self._wrong = wrong
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
        record = perfect()
        with tempfile.TemporaryDirectory() as folder:
            if not self._friction:
                record = record.model_copy(update={"actuators": _without_friction(Path(folder))})
            urdf = self.urdf if self._wrong is None else with_other_masses(self.urdf, WRONG, self._wrong)
            bundle = load_bundle(record, urdf)
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
