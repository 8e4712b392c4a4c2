"""What physics engines make of robots: accelerations, weights, and the contacts of wheels that roll.

python benchmark/engines.py robots [--json]
python benchmark/engines.py contacts [--solref SECONDS] [--solimp D] [--impratio RATIO] [--json] [--engine NAME]
python benchmark/engines.py wheels [--json]

`robots`: 50 drawn postures of each robot in the air, at rest, with drawn torques: the accelerations of one step against
those of Pinocchio, over the largest one; and what carries it after 1.5 s, over its weight. `contacts`: CENTAURO with
perfect sensors drives at 0.5 m/s for 6 s, or stands for 6 s; figures of the last second, and how far wheels have moved
in the last 5 s. With MuJoCo its contacts can be changed. `wheels`: one of CENTAURO's wheels leans to the side and
rolls below 20 kg: by how much its height, its contact and its rolling radius miss those of its torus.
"""

import math
from argparse import Namespace
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
import pinocchio
from form import Figures, add_engine, parser_of

from solfer.model.urdf.description import Description
from solfer.simulation import Simulation, read_bundle
from solfer.simulation.bundle import load_bundle
from solfer.simulation.engines import default_engine, make_engine
from solfer.simulation.loading.wheels import TorusWheel, wheels_of
from solfer.simulation.physics import STEP
from solfer.simulation.world.records import ENGINES, Friction
from solfer_tools.cli.skeletons.collections import EXAMPLES, folder_of

CENTAURO = Path(__file__).resolve().parent.parent / "config" / "robots" / "centauro" / "robot.yaml"
WHEELS = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))
ROBOTS = {
    "solo_description/robots/solo12.urdf": True,
    "hyq_description/robots/hyq_no_sensors.urdf": True,
    "anymal_c_simple_description/urdf/anymal.urdf": True,
    "go1_description/urdf/go1.urdf": True,
    "go2_description/urdf/go2.urdf": True,
    "b1_description/urdf/b1.urdf": True,
    "talos_data/robots/talos_reduced.urdf": True,
    "panda_description/urdf/panda.urdf": False,
    "ur_description/urdf/ur5_robot.urdf": False,
    "kinova_description/robots/kinova.urdf": False,
}
"""Files of example-robot-data, and whether the base floats."""


def acceleration_error(engine: str, path: Path, floats: bool) -> float:
    """Return the largest difference of accelerations from Pinocchio's, over the largest acceleration."""
    bundle = load_bundle(read_bundle(path, None, floats))
    joints = bundle.kinematics.dofs[6 if floats else 0 :]
    free = [pinocchio.JointModelFreeFlyer()] if floats else []
    model = pinocchio.buildModelFromUrdf(str(path), *free)
    numbers = [model.joints[model.getJointId(joint)] for joint in joints]
    data, random, worst = model.createData(), np.random.default_rng(5), 0.0
    with closing(make_engine(engine)) as made:
        robot = made.load_robot(bundle.description, joints, bundle.friction, floats=floats)
        robot.set_losses([0.0] * len(joints), [0.0] * len(joints), np.ones(len(joints)))
        group = robot.group(range(len(joints)))
        for _ in range(50):
            q, torque = pinocchio.neutral(model), np.zeros(model.nv)
            positions = np.zeros(len(joints))
            for index, joint in enumerate(numbers):
                if joint.nq == 1:
                    limits = (model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q])
                    low, high = np.clip(limits, -3.0, 3.0)
                    positions[index] = q[joint.idx_q] = random.uniform(0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high)
                else:
                    positions[index] = random.uniform(-3.0, 3.0)
                    q[joint.idx_q : joint.idx_q + 2] = np.cos(positions[index]), np.sin(positions[index])
                torque[joint.idx_v] = 0.5 * random.normal()
            expected = pinocchio.aba(model, data, q, np.zeros(model.nv), torque)[[joint.idx_v for joint in numbers]]
            robot.place_joints(positions)
            robot.place_base((0.0, 0.0, 50.0), (0.0, 0.0, 0.0, 1.0))
            group.apply_torques(torque[[joint.idx_v for joint in numbers]])
            made.step()
            position, velocity = np.zeros((2, len(joints)))
            robot.read_joints(position, velocity)
            found = velocity / STEP
            worst = max(worst, float(abs(found - expected).max() / max(1.0, abs(expected).max())))
    return worst


def weight_ratio(engine: str, path: Path) -> float:
    """Return the vertical forces of the ground over the weight, 1.5 s after the start."""
    with closing(Simulation.from_file(read_bundle(path, None, True), engine=engine)) as simulation:
        for _ in range(1500):
            simulation.step()
        return float(sum(force[2] for force in simulation.contacts().values()) / simulation.body.mass() / 9.81)


def robots(given: Namespace, figures: Figures) -> None:
    """Compare the engines on robots of others."""
    folder = folder_of(EXAMPLES)
    for name, floats in ROBOTS.items():
        row: dict[str, float | None] = {}
        for engine in ENGINES:
            row[f"{engine}_acceleration"] = acceleration_error(engine, folder / name, floats)
            row[f"{engine}_weight"] = weight_ratio(engine, folder / name) if floats else None
        figures.row(Path(name).stem, **row)


def rolled(given: Namespace, speeds: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return vertical forces of the last second, shape (1000, 4) [N], and ways of the wheels in 5 s, shape (4,) [m]."""
    engine = make_engine()
    with closing(Simulation(load_bundle(read_bundle(CENTAURO).with_perfect_sensors()), engine=engine)) as simulation:
        if default_engine() == "mujoco":
            model = engine._world.model  # type: ignore[attr-defined]
            model.geom_solref[:, 0], model.geom_solimp[:, :2] = given.solref, given.solimp
            model.opt.impratio = given.impratio
        places = []
        forces = []
        for count in range(6000):
            torque, _ = simulation.lower_level.update(simulation.q, simulation.v, STEP)
            simulation.body.apply(torque, min(1.0, count * STEP) * np.asarray(speeds))
            engine.step()
            simulation.body.read(simulation.q, simulation.v, simulation._motor_torque)
            simulation.state.now.expire()
            if count in (999, 5999):
                places.append([simulation.state.now.position(wheel)[:2].copy() for wheel in WHEELS])
            if count >= 5000:
                found = simulation.contacts()
                forces.append([found[wheel][2] if wheel in found else 0.0 for wheel in WHEELS])
    return np.array(forces), np.linalg.norm(np.subtract(*places), axis=1)


def contacts(given: Namespace, figures: Figures) -> None:
    """Measure the contacts of CENTAURO's wheels."""
    driving, _ = rolled(given, (6.4, -6.4, 6.4, -6.4))
    _, ways = rolled(given, (0.0, 0.0, 0.0, 0.0))
    deviations, means = driving.std(axis=0), driving.mean(axis=0)
    figures.row(
        f"{default_engine()}: solref {given.solref:g}, solimp {given.solimp:g}, impratio {given.impratio:g}",
        least_deviation_N=float(deviations.min()),
        most_deviation_N=float(deviations.max()),
        lost_percent=100.0 * float((driving <= 0.0).mean()),
        creep_mm=1e3 * float(ways.max()),
        forces_N=", ".join(f"{mean:.0f}" for mean in means),
    )


CART = """<robot name="cart"><link name="rail"/>
  <joint name="way" type="prismatic"><parent link="rail"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="0" velocity="9"/></joint>
  <link name="slide"><inertial><mass value="1"/>{inertia}</inertial></link>
  <joint name="height" type="prismatic"><parent link="slide"/><child link="fork"/><axis xyz="0 0 1"/>
    <limit lower="-9" upper="9" effort="0" velocity="9"/></joint>
  <link name="fork"><inertial><mass value="20"/>{inertia}</inertial></link>
  <joint name="axle" type="continuous"><parent link="fork"/><child link="wheel_1"/>
    <origin rpy="{roll} 0 0"/><axis xyz="0 0 1"/></joint>
  <link name="wheel_1"><inertial><mass value="1.7"/>{inertia}</inertial>
    <collision><geometry><sphere radius="0.078"/></geometry></collision></link></robot>"""
"""A wheel of CENTAURO below a load that moves along x and z."""


def wheel_errors(name: str, camber: float, torus: TorusWheel) -> np.ndarray:
    """Return by how much a wheel misses the height, the contact and the rolling radius of its torus, shape (3,) [m]."""
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    text = CART.format(inertia=inertia, roll=camber - 0.5 * math.pi)
    height = torus.ring * math.cos(camber) + torus.tube
    with closing(make_engine(name)) as engine:
        joints = ("way", "height", "axle")
        described = Description.from_text(text)
        robot = engine.load_robot(described, joints, Friction(), floats=False, wheels={"wheel_1": torus})
        robot.set_losses([0.0] * 3, [0.0] * 3, np.ones(3))
        engine.add_plane((0.0, 0.0, 1.0), 1.0)
        robot.place_joints([0.0, height, 0.0])
        drive = robot.group([2])
        places = []
        for count in range(1000):
            drive.hold_speeds(np.array([6.4]), (100.0,))
            engine.step()
            if count in (499, 999):
                position, velocity = np.zeros((2, len(joints)))
                robot.read_joints(position, velocity)
                places.append(position)
        way, _, angle = np.subtract(*places)
        contact = np.mean([point.position[1] for point in robot.contacts()])
        found = np.array((places[1][1], contact, way / angle))
    return found - (height, torus.ring * math.sin(camber), torus.ring + torus.tube * math.cos(camber))


def wheels(given: Namespace, figures: Figures) -> None:
    """Compare a leaning wheel with its torus."""
    torus = wheels_of(load_bundle(read_bundle(CENTAURO)).equipment.contacts)["wheel_1"]
    for camber in (0.0, 5.0, 10.0, 15.0, 20.0):
        for name in ENGINES:
            errors = 1e3 * wheel_errors(name, math.radians(camber), torus)
            row = dict(zip(("height_mm", "contact_mm", "radius_mm"), errors.tolist(), strict=True))
            figures.row(f"{camber:g} degrees, {name}", **row)


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("what", choices=("robots", "contacts", "wheels"))
    parser.add_argument("--solref", type=float, default=0.004, help="time constant of contacts [s]")
    parser.add_argument("--solimp", type=float, default=0.9, help="impedance of contacts")
    parser.add_argument("--impratio", type=float, default=1.0, help="stiffness of friction over that of normal forces")
    add_engine(parser)
    chosen = parser.parse_args()
    {"robots": robots, "contacts": contacts, "wheels": wheels}[chosen.what](chosen, Figures(chosen.json))
