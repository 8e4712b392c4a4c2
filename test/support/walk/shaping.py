"""The tags of `support_shaping`, each with a change that has to change how CENTAURO drives, or what it warns of."""

import logging
import re
from pathlib import Path

from support.walk.changes import Change
from support.walk.wheels import COMPONENT, WHEELS, centauro, driving, far, lifting, made

from solfer.components.support_shaping import SupportShaping


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


def lifted(folder: Path) -> str:
    """Shift the weight away from a wheel; return where to."""
    return lifting(folder, SupportShaping)


def strayed(folder: Path) -> str:
    """Begin far from the reference of the base; return what is wrong with that."""
    return far(folder, SupportShaping)


NARROW = {COMPONENT + "margins": [0.45, 0.3, 0.3, 0.45], COMPONENT + "vertex_acceleration": 100.0}
IMPOSSIBLE = {COMPONENT + "margins": [1.5], COMPONENT + "workspaces": [0.62]}
ORIGINAL = {
    COMPONENT + "law": "original",
    COMPONENT + "margins": [0.5, 0.3, 0.3, 0.6],
    COMPONENT + "workspaces": [0.55],
}

DRIVEN = {
    tag: Change(shaping, change.after, change.before) for tag, change in WHEELS.items() if change.bench is driving
}
"""The tags of `wheeled_motion`, with the same changes."""

SHAPING = {
    **DRIVEN,
    "track": Change(shaping, {COMPONENT + "track": "three", COMPONENT + "hips": "three"}),
    "IK": Change(shaping, {COMPONENT + "IK": ["CONSTRAINTS", "BASE", "CONTACT_POINTS"]}),
    **{
        tag: Change(shaping, {COMPONENT + tag: value}, NARROW)
        for tag, value in (
            ("margins", [0.1]),
            ("margin_gain", 1.0),
            ("horizon", 5.0),
            ("recovery", 0.01),
            ("balance", "center_of_mass"),
        )
    },
    "workspaces": Change(shaping, {COMPONENT + "workspaces": [0.6]}),
    "workspace_gain": Change(shaping, {COMPONENT + "workspace_gain": 1.0}, {COMPONENT + "workspaces": [0.6]}),
    "hips": Change(shaping, {COMPONENT + "hips": "wheels"}, {COMPONENT + "workspaces": [0.6]}),
    "warn_below": Change(shaping, {COMPONENT + "warn_below": 0.5}),
    "lift_margin": Change(lifted, {COMPONENT + "lift_margin": 0.1}, {COMPONENT + "base": "center_of_mass"}),
    "furthest": Change(strayed, {COMPONENT + "furthest": 0.1}),
    "infeasible": Change(standing, {COMPONENT + "infeasible": "hold"}, IMPOSSIBLE),
    "reactive": Change(shaping, {COMPONENT + "reactive": True}, {COMPONENT + "reactive_margin": 0.5}),
    "reactive_margin": Change(shaping, {COMPONENT + "reactive_margin": 0.5}, {COMPONENT + "reactive": True}),
    "centers": Change(shaping, {COMPONENT + "centers": True}, ORIGINAL),
}
"""All tags."""
