"""The tags of `wheeled_motion`, each with a change that has to change how CENTAURO drives."""

import hashlib
from functools import cache
from pathlib import Path

from support.unit.declarations import named
from support.walk.changes import Change, each

from solfer import Robot
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.drive import Twist
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import read
from solfer.errors import ComponentError
from solfer.interfaces.support import LiftContacts
from solfer.interfaces.task_references import Vector

BUNDLE = Path(__file__).parents[3] / "config/robots/centauro"
COMPONENT = "driving/driving/"
STEERING = {"icm": 0.5, "sp": 0.5, "damp_icm": 1e-3, "damp_sp": 1e-5, "damp": 1e-2, "tracking": 3.0}
AS_STEERINGS_SAY = {COMPONENT + "across": 0.0}
FAST_STEERING = {COMPONENT + "pace": False, COMPONENT + "tunnings/slow/STEERING": 190.0}
FAST_STEERING |= {COMPONENT + "vertex_speed": 1.0, COMPONENT + "vertex_acceleration": 100.0}


@cache
def centauro() -> Robot:
    """Load the robot, once."""
    front = '<group name="front"><link name="wheel_1"/><link name="wheel_2"/></group>'
    three = "".join(f'<link name="wheel_{leg}"/>' for leg in (1, 2, 3))
    groups = f'{front}<group name="three">{three}</group></robot>'
    srdf = (BUNDLE / "centauro.srdf").read_text().replace("</robot>", groups)
    return Robot.load(BUNDLE / "centauro.urdf", srdf, contacts=BUNDLE / "contacts.yaml")


def made(folder: Path, kind: type[WheeledMotion] = WheeledMotion) -> WheeledMotion:
    """Make the component at its start."""
    robot = centauro()
    dofs, values = robot.named_state("mammal_wide_straight")
    robot.state.position[:], robot.state.velocity[:] = 0.0, 0.0
    robot.state.position[dofs] = values
    component = kind(robot, read(folder / "driving.yaml", kind.Tags, ("driving",)), "driving")
    component.set_rate(200.0)
    component.init()
    return component


def lifting(folder: Path, kind: type[WheeledMotion] = WheeledMotion) -> str:
    """Shift the weight away from a wheel; return where to."""
    component = made(folder, kind)
    component.model.update()
    component.update()
    named(component.services(), "lift").handler(LiftContacts(("front_left_leg",)))
    return str(component._lifting.shift.goal)


def driving(folder: Path, kind: type[WheeledMotion] = WheeledMotion) -> str:
    """Stand a moment with base and vertices that are a little off, then drive a curve; return a digest of it all."""
    component, robot = made(folder, kind), centauro()
    component.references.vertices[:, :2] += 1e-3
    component.references.position[:2] += 2e-3
    component.references.heading += 2e-3
    digest = hashlib.sha256()
    for index in range(40):
        if index == 10:
            component.drive.receive(Twist(Vector(0.3, 0.1), Vector(0.0, 0.0, 0.4)))
            velocity = ((0.0, 0.3, 0.0, 0.0, 0.0, 0.0) * 2)[: component.references.vertices.size]
            component.targets.receive(WheelsSupport(velocity=velocity))
        robot.update()
        component.update()
        component.send()
        robot.state.position[:30], robot.state.velocity[:30] = robot.command.position[:30], robot.command.velocity[:30]
        digest.update(robot.command.velocity.round(12).tobytes())
    digest.update(component.references.vertices.tobytes())
    return digest.hexdigest()


def far(folder: Path, kind: type[WheeledMotion] = WheeledMotion) -> str:
    """Begin 0.2 m from the reference of the base; return what is wrong with that."""
    component = made(folder, kind)
    component.references.position[0] += 0.2
    component.model.update()
    try:
        component.update()
    except ComponentError as error:
        return str(error)
    return ""


WHEELS = {
    **each(
        driving,
        COMPONENT,
        chain="position_lower_body",
        track="front",
        IK=["CONSTRAINTS", "BASE", "STEERING"],
        tunning="fast",
        base="center_of_mass",
        minor_axis=0.06,
        major_axis=0.02,
        law="original",
        across=0.0,
        base_speed=0.02,
        turn_speed=0.02,
        vertex_speed=0.01,
        vertex_acceleration=1.0,
        acceleration=1.0,
        turn_acceleration=1.0,
        support_margin=0.5,
        correction=1e-3,
        turn_correction=1e-3,
    ),
    "furthest": Change(far, {COMPONENT + "furthest": 0.1}),
    "lift_margin": Change(lifting, {COMPONENT + "lift_margin": 0.1}, {COMPONENT + "base": "center_of_mass"}),
    "tunnings": Change(driving, {COMPONENT + "tunnings/slow/STEERING": 12.0}),
    **{
        f"reference_axis.NAME.{axis}": Change(driving, {f"{COMPONENT}reference_axis/wheel_1/{axis}": value})
        for axis, value in (("x", 0.1), ("y", 0.1), ("z", 2.0))
    },
    **{
        f"steerings.NAME.{tag}": Change(driving, {f"{COMPONENT}steerings/reactif/{tag}": value}, AS_STEERINGS_SAY)
        for tag, value in STEERING.items()
    },
    "steering": Change(driving, {COMPONENT + "steering": "other"}, AS_STEERINGS_SAY),
    "rest": Change(driving, {COMPONENT + "rest": False}, AS_STEERINGS_SAY),
    "pace": Change(driving, {COMPONENT + "pace": False}),
}
