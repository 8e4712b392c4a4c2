"""Puts a quadruped of `example-robot-data` on wheels: a folder with its model, its contacts and a configuration.

python examples/wheeled_quadruped.py {anymal_c,go2} FOLDER [--fixed]

It comes with `pip install -r requirements-examples.txt`. Wheels of anymal_c get a joint above them that steers; those
of go2, and of any with --fixed, roll straight ahead only. `docs/how-to/wheels.md` says what both do.
"""

import argparse
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from string import Template
from xml.etree.ElementTree import Element, fromstring, indent, tostring

import numpy as np

from solfer import Robot

SHARE = "cmeel.prefix/share/example-robot-data"
PACKAGE = "package://example-robot-data"
TASKS = ("CONSTRAINTS", "BASE", "STEERING", "CONTACT_POINTS")


@dataclass(frozen=True)
class Quadruped:
    """A robot whose feet become wheels; links are those of the front left leg, the front right, rear left, rear right.

    Attributes:
        urdf: Its model, by the folder of all robots.
        srdf: Its groups and states; it stands in the state `standing`.
        base: Link of its base.
        feet: Links at the ends of its legs.
        hips: Links at their beginnings.
        steers: Whether a joint above each wheel steers it.
        radius: Radius of its wheels [m].
        drop: How far the wheels' centres are below the feet where they are steered [m].
        mass: Mass of a wheel, and of the fork above it [kg].
        effort, speed: Largest torque [Nm] and speed [rad/s] of a wheel.
        margin, workspace: Limits for `support_shaping` [m].
    """

    urdf: str
    srdf: str
    base: str
    feet: tuple[str, ...]
    hips: tuple[str, ...]
    steers: bool
    radius: float
    drop: float
    mass: float
    effort: float
    speed: float
    margin: float
    workspace: float


ROBOTS = {
    "anymal_c": Quadruped(
        "anymal_c_simple_description/urdf/anymal.urdf",
        "anymal_c_simple_description/srdf/anymal.srdf",
        "base",
        ("LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"),
        ("LF_HIP", "RF_HIP", "LH_HIP", "RH_HIP"),
        steers=True,
        radius=0.1,
        drop=0.12,
        mass=1.5,
        effort=40.0,
        speed=25.0,
        margin=0.12,
        workspace=0.75,
    ),
    "go2": Quadruped(
        "go2_description/urdf/go2.urdf",
        "go2_description/srdf/go2.srdf",
        "base",
        ("FL_foot", "FR_foot", "RL_foot", "RR_foot"),
        ("FL_hip", "FR_hip", "RL_hip", "RR_hip"),
        steers=False,
        radius=0.08,
        drop=0.1,
        mass=0.6,
        effort=20.0,
        speed=30.0,
        margin=0.06,
        workspace=0.42,
    ),
}


def main() -> None:
    """Write the robot's folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robot", choices=ROBOTS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--fixed", action="store_true", help="wheels without joints that steer them")
    given = parser.parse_args()
    try:
        share = Path(str(distribution("example-robot-data").locate_file(SHARE)))
    except PackageNotFoundError:
        parser.exit(2, "error: the robots are not installed\n  expected: pip install -r requirements-examples.txt\n")
    given.folder.mkdir(parents=True, exist_ok=True)
    quadruped = ROBOTS[given.robot]
    steers = quadruped.steers and not given.fixed
    write(given.folder, f"wheeled_{given.robot}", quadruped, steers, share)
    print(f"{given.folder}/robot.yaml has {'steered wheels' if steers else 'wheels that roll straight ahead'}")


def write(folder: Path, name: str, quadruped: Quadruped, steers: bool, share: Path) -> None:
    """Write all files of a robot into its folder."""
    urdf, srdf = (share / "robots" / file for file in (quadruped.urdf, quadruped.srdf))
    robot = Robot.load(str(urdf), srdf, floating_base=True)
    indices, values = robot.named_state("standing")
    robot.state.position[indices] = values
    robot.update()
    model = fromstring(urdf.read_bytes())
    model.set("name", name)
    for mesh in model.iter("mesh"):
        mesh.set("filename", mesh.get("filename", "").replace(PACKAGE, f"file://{share}"))
    for foot in quadruped.feet:
        put_on_wheel(model, foot, robot.kinematics.rotation(foot), quadruped, steers)
    if all(each.get("type") != "floating" for each in model.iter("joint")):
        model.append(Element("link", name="world"))
        model.append(joint("floating_base", "floating", "world", quadruped.base))
    indent(model)
    joints = {robot.dofs[dof]: value for dof, value in zip(indices, values, strict=True) if dof >= 6}
    tasks = [task for task in TASKS if steers or task != "STEERING"]
    plugins = Template(Path(__file__).with_suffix(".yaml").read_text())
    files = {
        "robot.urdf": tostring(model, encoding="unicode"),
        "robot.srdf": semantics(name, quadruped, joints),
        "contacts.yaml": contacts(name, quadruped),
        "robot.yaml": bundle(name, quadruped.base),
        "plugins.yaml": plugins.substitute(
            name=name,
            base=quadruped.base,
            tasks=f"[{', '.join(tasks)}]",
            margin=quadruped.margin,
            workspace=quadruped.workspace,
        ),
    }
    for file, text in files.items():
        (folder / file).write_text(text)


def put_on_wheel(model: Element, foot: str, rotation: np.ndarray, quadruped: Quadruped, steers: bool) -> None:
    """Put a wheel below a foot, upright in the posture in which the foot has a rotation in the world."""
    (link,) = (each for each in model.iter("link") if each.get("name") == foot)
    for shape in link.findall("collision"):
        link.remove(shape)
    upright = "{:.9f} {:.9f} {:.9f}".format(*angles(rotation.T))
    mass, radius, carrier, origin = quadruped.mass, quadruped.radius, foot, (upright, "0 0 0")
    if steers:
        carrier, fork = f"{foot}_fork", turning(*origin, "0 0 1", lower=-2.6, upper=2.6, effort=40, velocity=8)
        model.append(body(carrier, mass, radius))
        model.append(joint(f"{foot}_steering", "revolute", foot, carrier, fork))
        origin = "0 0 0", f"0 0 {-quadruped.drop}"
    shapes = (
        f'<visual><origin rpy="1.570796327 0 0"/><geometry><cylinder length="{0.6 * radius}" radius="{radius}"/>'
        f'</geometry></visual><collision><geometry><sphere radius="{radius}"/></geometry></collision>'
    )
    model.append(body(f"{foot}_wheel", mass, radius, shapes))
    axle = turning(*origin, "0 1 0", effort=quadruped.effort, velocity=quadruped.speed)
    model.append(joint(f"{foot}_axle", "continuous", carrier, f"{foot}_wheel", axle))


def body(name: str, mass: float, radius: float, shapes: str = "") -> Element:
    """Make a link with the inertia of a ball."""
    inertia = 0.4 * mass * radius**2
    tag = f'<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/>'
    return fromstring(f'<link name="{name}">{shapes}<inertial><mass value="{mass}"/>{tag}</inertial></link>')


def joint(name: str, kind: str, parent: str, child: str, more: str = "") -> Element:
    """Make a joint."""
    links = f'<parent link="{parent}"/><child link="{child}"/>'
    return fromstring(f'<joint name="{name}" type="{kind}">{links}{more}</joint>')


def turning(rpy: str, xyz: str, axis: str, **limit: float) -> str:
    """Write the origin, the axis and the limits of a joint."""
    limits = " ".join(f'{key}="{value}"' for key, value in limit.items())
    return f'<origin rpy="{rpy}" xyz="{xyz}"/><axis xyz="{axis}"/><limit {limits}/>'


def angles(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation as URDF has them [rad]."""
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    return float(roll), float(-np.arcsin(rotation[2, 0])), float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def semantics(name: str, quadruped: Quadruped, joints: dict[str, float]) -> str:
    """Write the SRDF: groups of wheels and hips, and the state in which the robot stands."""
    groups = {"wheels": [f"{foot}_wheel" for foot in quadruped.feet], "hips": quadruped.hips}
    lines = [f'<robot name="{name}">']
    for group, links in groups.items():
        lines += [f'  <group name="{group}">', *(f'    <link name="{link}"/>' for link in links), "  </group>"]
    lines += ['  <group name="legs">', *(f'    <joint name="{joint}"/>' for joint in joints), "  </group>"]
    lines += ['  <group_state name="standing" group="legs">']
    lines += [f'    <joint name="{joint}" value="{value}"/>' for joint, value in joints.items()]
    return "\n".join([*lines, "  </group_state>", "</robot>", ""])


def contacts(name: str, quadruped: Quadruped) -> str:
    """Write the contacts: where wheels touch the ground."""
    lines = [f"{name}:", "  contacts:"]
    for index, foot in enumerate(quadruped.feet):
        lines += [
            f"    contact{index}:",
            f"      name: {foot}",
            f"      end_frame: {foot}_wheel",
            "      type: wheel",
            "      position: [0.0, 0.0, 0.0]",
            f"      offset: [0.0, 0.0, {-quadruped.radius}]",
            "      constraint_matrix:",
            "        force_1: [0, 0, 0, 1, 0, 0]",
            "        force_2: [0, 0, 0, 0, 1, 0]",
            "        force_3: [0, 0, 0, 0, 0, 1]",
            f"      minor_axis: {quadruped.radius}",
            "      major_axis: 0.0",
            "      reference_axis: {x: 0, y: 1, z: 0}",
        ]
    return "\n".join([*lines, ""])


def bundle(name: str, base: str) -> str:
    """Write the file that names all others, the controllers, and the IMU of the base; gains are automatic."""
    return f"""name: {name}
urdf: robot.urdf
srdf: robot.srdf
contacts: contacts.yaml
start: {{state: standing}}
controllers:
  position_controller: {{type: impedance, group: all, except: wheels}}
  velocity_controller: {{type: velocity, group: wheels}}
friction:
  default: 0.3
  groups: {{wheels: 0.8}}
sensors:
  imu: {{link: {base}}}
  rates: {{joints: 200, base: 200, imu: 200}}
"""


if __name__ == "__main__":
    main()
