"""CENTAURO that drives by `wheeled_motion` or `support_shaping`, with tags of a file of the walk."""

import hashlib
import logging
import re
from functools import cache
from pathlib import Path

from support.unit.declarations import named

from solfer import Robot
from solfer.components.support_shaping import SupportShaping
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.config import read
from solfer.errors import ComponentError
from solfer.interfaces.geometry import Twist
from solfer.interfaces.support import LiftContacts
from solfer.interfaces.task_references import Vector

BUNDLE = Path(__file__).parents[3] / "config/robots/centauro"


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


class _Words(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.words: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message."""
        self.words.append(record.getMessage())


def shaping(folder: Path) -> str:
    """Drive the curve of `driving` with a pushed base; return a digest, and the limits of which it warns."""
    logger, words = logging.getLogger("solfer.components.support_shaping.report"), _Words()
    logger.addHandler(words)
    robot = centauro()
    robot.contacts.forces  # noqa: B018 they are made
    for contact in robot.contacts:
        contact.wrench[:3] = 0.0, 0.0, 200.0 if contact is robot.contacts["rear_left_leg"] else 100.0
    try:
        motion = driving(folder, SupportShaping)
        return motion + str(sorted({name for text in words.words for name in re.findall("'([^']+)'", text)}))
    finally:
        logger.removeHandler(words)
        for contact in robot.contacts:
            contact.wrench[:] = 0.0


def standing(folder: Path) -> str:
    """Stand for a while; return the share of the motion that goes on."""
    component, robot = made(folder, SupportShaping), centauro()
    for _ in range(400):
        robot.update()
        component.update()
        component.send()
        robot.state.position[:30], robot.state.velocity[:30] = robot.command.position[:30], robot.command.velocity[:30]
    return str(component.shaping.governor.ratio)
