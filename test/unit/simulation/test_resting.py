"""Robots that would fall over upright: how they are put down."""

import math
from contextlib import closing

import numpy as np
import pytest

from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation, read_bundle
from solfer.simulation.robot_body.placement import StartPlacement

ANKLE = 0.06
"""Angle between the sole and the ground while the robot is upright [rad]."""

ROBOT = """<robot name="statue">
  <link name="trunk"><inertial><origin xyz="{x} 0 0"/><mass value="10"/>
    <inertia ixx="0.2" iyy="0.2" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="ankle" type="revolute"><parent link="trunk"/><child link="foot"/><origin xyz="0 0 -0.5"/>
    <axis xyz="0 -1 0"/><limit lower="-1" upper="1" effort="100" velocity="10"/></joint>
  <link name="foot"><inertial><mass value="0.5"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>{shapes}</link></robot>"""
SOLE = '<collision><geometry><box size="0.1 0.2 0.02"/></geometry></collision>'
POINT = '<collision><origin xyz="{} 0.1 0"/><geometry><sphere radius="0.01"/></geometry></collision>'
POINTS = POINT.format(-0.05) + POINT.format(0.05)
STANDING = """<robot name="statue"><group name="all"><joint name="ankle"/></group>
  <group_state name="standing" group="all"><joint name="ankle" value="{}"/></group_state></robot>"""


@pytest.fixture
def put(tmp_path):
    """Put down a statue that has its centre of mass at `x` and these shapes for a foot."""

    def simulated(x: float, shapes: str = SOLE, ankle: float = ANKLE, world: str = "{}") -> Simulation:
        urdf, srdf, ground = tmp_path / "statue.urdf", tmp_path / "statue.srdf", tmp_path / "world.yaml"
        urdf.write_text(ROBOT.format(x=x, shapes=shapes))
        srdf.write_text(STANDING.format(ankle))
        ground.write_text(world)
        return Simulation.from_file(read_bundle(urdf, srdf, floating_base=True), world=ground)

    return simulated


def turned(simulation: Simulation) -> np.ndarray:
    """Rotation vector of the base against upright, small, in world axes, shape (3,) [rad]."""
    rotation = rotation_from_quaternion(simulation.body.orientation)
    odd = 0.5 * (rotation - rotation.T)
    return np.array([odd[2, 1], odd[0, 2], odd[1, 0]])


@pytest.mark.parametrize("slope", [0.0, -0.03])
def test_a_sole_is_put_down_flat(put, caplog, slope):
    """It stays as it is put down, for a while."""
    with closing(put(-0.055, world=f"ground: {{slope: {slope}}}")) as simulation:
        assert "begins tilted by 3.4 degrees" in caplog.text
        before, height = np.array([0.0, math.sin(ANKLE - slope), 0.0]), simulation.body.position[2]
        np.testing.assert_allclose(turned(simulation), before, atol=1e-4)
        for _ in range(700):
            simulation.step()
        assert simulation.body.position[2] == pytest.approx(height, abs=2e-3)
        np.testing.assert_allclose(turned(simulation), before, atol=0.02)
        assert simulation.contact_links() == ("foot",)


def test_yaw_and_height_keep_the_tilt(put):
    with closing(put(-0.055)) as simulation:
        simulation.reset(placement=StartPlacement(yaw=math.pi / 2.0, height=0.1))
        vertical = rotation_from_quaternion(simulation.body.orientation)[2]
        np.testing.assert_allclose(vertical, [-math.sin(ANKLE), 0.0, math.cos(ANKLE)], atol=1e-4)
        assert not simulation.contact_links()


@pytest.mark.parametrize(
    "x, shapes, ankle",
    [
        (0.0, SOLE, 0.0),  # it rests upright
        (0.01, SOLE, 0.002),  # it comes to rest by itself
        (0.0, POINTS, ANKLE),  # a line of two points carries nothing
        (-0.5, SOLE, ANKLE),  # the centre of mass is beyond its sole, however it is tilted
        (0.0, SOLE, 0.3),  # its sole is flat when it has fallen
    ],
    ids=["upright", "nearly", "line", "beyond", "fallen"],
)
def test_others_begin_upright(put, caplog, x, shapes, ankle):
    with closing(put(x, shapes, ankle)) as simulation:
        assert not turned(simulation).any()
        assert "tilted" not in caplog.text
