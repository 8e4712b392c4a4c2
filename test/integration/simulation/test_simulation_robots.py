"""Robots other than CENTAURO, with nothing but a URDF."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pybullet
import pybullet_data
import pytest
from support.bullet import raw_bullet
from support.unit.chains import chain

from solfer.errors import ModelError, SimulationError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.trial import simulate_for_a_second

DATA = Path(pybullet_data.getDataPath())
BODY = """<robot name="pair">
  <link name="base">{inertial}</link>
  <link name="arm"><inertial><mass value="1"/>{inertia}</inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
</robot>"""


def bundle(folder, urdf, floating=None):
    """Write a bundle that names a URDF and nothing else."""
    file = folder / "robot.yaml"
    base = "" if floating is None else f"floating_base: {str(floating).lower()}\n"
    file.write_text(f"name: robot\nurdf: {urdf}\n{base}")
    return file


def run(simulation, steps):
    """Step and close."""
    for _ in range(steps):
        simulation.step()
    simulation.close()


def test_a_fixed_arm_holds_its_position(tmp_path):
    simulation = Simulation.from_file(bundle(tmp_path, DATA / "kuka_iiwa/model.urdf"))
    assert not simulation.floating and len(simulation.q) == 7
    start = simulation.q.copy()
    run(simulation, 1000)
    np.testing.assert_allclose(simulation.q, start, atol=1e-3)
    assert simulation.body.base_link == "lbr_iiwa_link_0"


def test_a_floating_robot_stands_on_its_wheels(tmp_path):
    simulation = Simulation.from_file(bundle(tmp_path, DATA / "r2d2.urdf", floating=True))
    assert simulation.floating and len(simulation.q) == 6 + 8
    for _ in range(1000):
        simulation.step()
    forces = simulation.contacts()
    assert set(forces) == {f"{side}_{end}_wheel" for side in ("left", "right") for end in ("front", "back")}
    assert sum(force[2] for force in forces.values()) == pytest.approx(9.81 * simulation.kinematics.mass, rel=1e-6)
    run(simulation, 0)


def stands(simulation, sag, drop):
    """Whether a quadruped stands for five seconds: joints [rad] and base [m] within bounds, at rest in the end."""
    start, height = simulation.q[6:].copy(), simulation.body.position[2]
    for _ in range(5000):
        simulation.step()
    np.testing.assert_allclose(simulation.q[6:], start, atol=sag)
    assert np.abs(simulation.v).max() < 0.02
    assert simulation.body.position[2] == pytest.approx(height, abs=drop)
    forces = simulation.contacts()
    assert len(forces) == 4
    assert sum(force[2] for force in forces.values()) == pytest.approx(9.81 * simulation.kinematics.mass, rel=1e-3)
    run(simulation, 0)


def test_a_quadruped_stands_with_nothing_but_its_urdf():
    simulation = Simulation.from_file(read_bundle(DATA / "a1/a1.urdf", floating_base=True))
    np.testing.assert_allclose(simulation.q[6:].reshape(4, 3)[:, 2], -0.916298, atol=1e-6)  # no knee can be straight
    stands(simulation, 0.01, 0.002)


def test_a_quadruped_stands_in_a_state(tmp_path):
    srdf = tmp_path / "a1.srdf"
    legs = "".join(
        f'<joint name="{leg}_upper_joint" value="0.8"/><joint name="{leg}_lower_joint" value="-1.6"/>'
        for leg in ("FR", "FL", "RR", "RL")
    )
    srdf.write_text(
        f'<robot name="a1"><group name="legs"><link name="trunk"/></group>'
        f'<group_state name="standing" group="legs">{legs}</group_state></robot>'
    )
    simulation = Simulation.from_file(read_bundle(DATA / "a1/a1.urdf", srdf, floating_base=True))
    assert sorted(set(simulation.q[6:].round(9))) == [-1.6, 0.0, 0.8]
    stands(simulation, 0.015, 0.003)


def test_a_pendulum_without_gains_swings_as_it_should(tmp_path):
    """Period of small swings about the lower rest: T = 2 pi sqrt((I + m l^2) / (m g l))."""
    urdf = tmp_path / "pendulum.urdf"
    urdf.write_text("""<robot name="pendulum"><link name="world"/>
      <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
        <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="swing" type="revolute"><parent link="world"/><child link="rod"/><origin xyz="0 0 2"/>
        <axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="100" effort="100"/></joint></robot>""")
    file = bundle(tmp_path, "pendulum.urdf")
    file.write_text(file.read_text() + "gains: gains.yaml\ncontrollers: {swing: {type: impedance}}\n")
    (tmp_path / "gains.yaml").write_text("robot: {gains: {swing: {stiffness: 0.0, damping: 0.0}}}\n")
    simulation = Simulation.from_file(file)
    simulation.body.place([0.05])
    simulation._read()
    angles = []
    for _ in range(5000):
        simulation.step()
        angles.append(simulation.q[0])
    falling = [step for step in range(1, 5000) if angles[step - 1] > 0.0 >= angles[step]]
    period = (falling[-1] - falling[0]) / (len(falling) - 1) * 1e-3
    assert period == pytest.approx(2.0 * np.pi * np.sqrt((0.1 + 2.0 * 0.25) / (2.0 * 9.81 * 0.5)), rel=2e-3)
    run(simulation, 0)


SOUND = '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>'
WRONG = '<inertia ixx="0.0" iyy="0.0" izz="0.3" ixy="0" ixz="0" iyz="0"/>'


def test_a_moving_link_without_mass_is_named(tmp_path):
    (tmp_path / "pair.urdf").write_text(BODY.format(inertial="", inertia=SOUND))
    with pytest.raises(ModelError, match="links move and have no mass: base"):
        Simulation.from_file(bundle(tmp_path, "pair.urdf", floating=True))


def test_what_makers_publish_moves(tmp_path, caplog):
    """An inertia that no body has, as of the fingers of Fetch, is replaced; H1-2 has materials without names."""
    visual = '<visual><geometry><sphere radius="1"/></geometry><material><color rgba="1 0 0 1"/></material></visual>'
    (tmp_path / "pair.urdf").write_text(BODY.format(inertial=visual, inertia=WRONG))
    run(Simulation.from_file(bundle(tmp_path, "pair.urdf", floating=False)), 1000)
    assert "link 'arm': 0, 0, 0.3 -> 0.100002, 0.100002, 0.199998 kg m^2 (by 58 %)" in caplog.text


def test_bullet_takes_the_repaired_inertia():
    """Bullet itself drops an inertia that misses what a body has by a rounding: the body would have none at all."""
    with closing(Simulation.from_file(read_bundle(DATA / "mini_cheetah/mini_cheetah.urdf", floating_base=True))) as run:
        bullet = raw_bullet(run)
        principal = sorted(pybullet.getDynamicsInfo(bullet.body, bullet.links["thigh_fr"], bullet.client)[2])
    np.testing.assert_allclose(principal, (0.000440112, 0.00182304, 0.00226306), rtol=1e-4)


@pytest.mark.parametrize(
    "shapes, published",
    [
        (
            '<collision><geometry><mesh filename="none.stl"/></geometry></collision>',
            "link 'base': the mesh 'none.stl' of a collision shape is not there",
        ),
        ("", "nothing carries the robot: its base floats, and it has no collision shapes"),
    ],
)
def test_a_body_that_cannot_stand_is_named(tmp_path, shapes, published):
    sound = f'<inertial><mass value="1"/>{SOUND}</inertial>{shapes}'
    (tmp_path / "pair.urdf").write_text(BODY.format(inertial=sound, inertia=SOUND))
    with pytest.raises(SimulationError, match=published) as caught:
        Simulation.from_file(bundle(tmp_path, "pair.urdf", floating=True))
    assert caught.value.expected


def test_more_joints_than_pybullet_takes_are_refused(tmp_path):
    (tmp_path / "long.urdf").write_text(chain(128))
    with pytest.raises(SimulationError, match="128 moving joints") as caught:
        Simulation.from_file(bundle(tmp_path, "long.urdf"))
    assert caught.value.expected == "at most 127"


def test_a_walker_that_is_held_is_reported(tmp_path, caplog):
    run(Simulation.from_file(bundle(tmp_path, DATA / "a1/a1.urdf")), 0)
    assert [message for message in caplog.messages if "a1.urdf: the base, link" in message]


def test_an_arm_in_the_ground_is_reported(tmp_path, caplog):
    """The rod hangs from z = 0 into the ground."""
    urdf = tmp_path / "rod.urdf"
    shape = '<collision><origin xyz="0 0 {z}"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision>'
    for z, warns in ((-0.05, True), (0.3, False)):
        text = BODY.format(inertial="", inertia=f"{SOUND}</inertial>{shape.format(z=z)}")
        urdf.write_text(text.replace("</collision></inertial>", "</collision>"))
        wrong = simulate_for_a_second(bundle(tmp_path, "rod.urdf"))
        assert wrong.startswith("link 'arm' begins 0.250 m inside of the world") == warns
        caplog.clear()
        simulation = Simulation.from_file(bundle(tmp_path, "rod.urdf"))
        SimulationServer(simulation, MemoryMiddleware(Bus(), "simulator"))
        assert caplog.messages == ([wrong] if warns else [])
        simulation.close()
