"""What a network and a robot agree on: joints by name, terms and widths of observations, actions and gains."""

import json
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from solfer.components.policy.network import PolicyNetwork
from solfer.components.policy.tags import TERMS, ActionRecord, ObservationRecord, PerJoint, PolicyTags
from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.robot import Robot

BASE_TERMS = ("angular_velocity", "projected_gravity", "linear_velocity")
"""Terms of a floating base."""

EXPORTED = {
    "base_ang_vel": "angular_velocity",
    "base_lin_vel": "linear_velocity",
    "command": "commands",
    "velocity_commands": "commands",
    "joint_pos": "joint_position",
    "joint_vel": "joint_velocity",
    "actions": "last_action",
}
"""Terms by their names in the metadata of files that mjlab writes."""

KEYS = {"joint_names": "dof_names", "joint_stiffness": "kp", "joint_damping": "kd"}
"""Keys of metadata as mjlab writes them, and as holosoma does."""


@dataclass(frozen=True)
class PolicyContract:
    """The meaning of a network's numbers; joints are in its order.

    Attributes:
        joints: Names of the m joints.
        dofs: Their DoFs, shape (m,).
        default: Default pose, shape (m,) [rad, m].
        terms: Terms of the observations.
        action: What actions are.
        scale: Factors of the actions, shape (m,).
        gains: Stiffness [Nm/rad, N/m] and damping [Nms/rad, Ns/m] by name, shape (m,); without those of neither source.
    """

    joints: tuple[str, ...]
    dofs: np.ndarray
    default: np.ndarray
    terms: tuple[ObservationRecord, ...]
    action: ActionRecord
    scale: np.ndarray
    gains: Mapping[str, np.ndarray]


def agree(tags: PolicyTags, network: PolicyNetwork, robot: Robot) -> PolicyContract:
    """Make the contract of tags and of the metadata of the file, where tags leave something out.

    Raises:
        UnknownName: A joint or a term is unknown.
        SizeMismatch: Widths do not add up.
        ComponentError: Something is missing, or named twice, or the robot has no base that the network observes.
        NotFinite: A number of the file is NaN or infinite.
    """
    source = _Source(tags, network.metadata)
    joints = source.joints()
    known = [robot.dofs[dof] for dof in robot.actuated]
    _check_names(joints, known, lambda index: source.place("joints", index))
    dofs = np.array([robot.dof(name) for name in joints], dtype=np.intp)
    if len(network.actions) != len(joints):
        what = f"the network has {len(network.actions)} actions, and {len(joints)} joints: {', '.join(joints)}"
        raise SizeMismatch(what, where=source.place("joints"), expected="one joint for each action")
    action = tags.action
    terms = source.terms()
    _check_terms(terms, len(joints), network, robot=robot, where=source.place("observations"))
    default = source.numbers(joints, tags.default, "default_joint_pos", path=("default",))
    if default is None:
        what = f"neither the tag `default` nor '{tags.file}' has a default pose"
        raise ComponentError(what, where=tags.where(), expected="`default`: one position for each joint")
    scale = source.numbers(joints, action.scale, "action_scale", path=("action", "scale"))
    gains = {
        name: source.numbers(joints, getattr(tags.gains, name), f"joint_{name}", path=("gains", name))
        for name in ("stiffness", "damping")
    }
    for name, numbers in gains.items():
        if numbers is not None and not (numbers >= 0.0).all():
            where = source.place("gains", name)
            raise ComponentError(f"a {name} of {numbers.min():g}", where=where, expected="numbers from zero on")
    return PolicyContract(
        joints,
        dofs,
        default,
        terms=terms,
        action=action,
        scale=np.ones(len(joints)) if scale is None else scale,
        gains={name: numbers for name, numbers in gains.items() if numbers is not None},
    )


def widths(terms: Sequence[ObservationRecord], count: int) -> Iterator[tuple[str, int]]:
    """Yield the name of each term and how many numbers it has with its history, for `count` joints."""
    for term in terms:
        yield term.term, width(term, count) * term.history


def width(term: ObservationRecord, count: int) -> int:
    """Return how many numbers of one step are observed of a term, for `count` joints."""
    return whole_width(term, count) if term.pick is None else len(term.pick)


def whole_width(term: ObservationRecord, count: int) -> int:
    """Return how many numbers of one step a term has, for `count` joints."""
    if term.term == "phase":
        return 2 * len(term.offsets)
    return 3 if term.term in (*BASE_TERMS, "commands") else count


def _check_numbers(term: ObservationRecord, count: int, where: str) -> None:
    """Check that a term has the numbers that are picked, and as many scales."""
    needed = width(term, count)
    largest = whole_width(term, count) - 1
    if term.pick is not None and max(term.pick) > largest:
        what = f"'{term.term}' has no number {max(term.pick)}"
        raise SizeMismatch(what, where=term.where("pick") or where, expected=f"numbers from 0 to {largest}")
    if isinstance(term.scale, tuple) and len(term.scale) != needed:
        what = f"'{term.term}' has {needed} numbers, and {len(term.scale)} scales"
        raise SizeMismatch(what, where=term.where("scale") or where, expected="one for all, or one for each")


def _check_terms(
    terms: Sequence[ObservationRecord], count: int, network: PolicyNetwork, *, robot: Robot, where: str
) -> None:
    for term in terms:
        _check_numbers(term, count, where)
        if term.term in BASE_TERMS and robot.kinematics.base is None:
            what = f"the network observes '{term.term}', and '{robot.name}' has no floating base"
            raise ComponentError(what, where=term.where() or where, expected="terms of joints, or a floating base")
    table = ", ".join(f"{name} {size}" for name, size in widths(terms, count))
    total = sum(size for _, size in widths(terms, count))
    if total != len(network.observations):
        what = f"the terms have {total} numbers, and the network observes {len(network.observations)}"
        raise SizeMismatch(what, where=where, expected=f"one number each; now they are {table}")


def _check_names(joints: Sequence[str], known: Collection[str], where: Callable[[int], str]) -> None:
    for index, name in enumerate(joints):
        if name not in known:
            raise UnknownName("joint", name, known, where=where(index))
        if name in joints[:index]:
            raise ComponentError(f"the joint '{name}' is named twice", where=where(index), expected="each joint once")


class _Source:
    """Tags, and the metadata of a file where tags leave something out."""

    def __init__(self, tags: PolicyTags, metadata: Mapping[str, str]):
        self._tags = tags
        others = {key: metadata[other] for key, other in KEYS.items() if other in metadata}
        self._metadata = others | dict(metadata)

    def place(self, *path: str | int) -> str:
        """Return the place of a tag, or of the file if it is left out."""
        given = path[0] in self._tags.model_fields_set
        return self._tags.where(*path) if given else self._tags.where("file")

    def joints(self) -> tuple[str, ...]:
        """Return the names of the joints."""
        if self._tags.joints is not None:
            return self._tags.joints
        return self._listed("joint_names", "joints")

    def terms(self) -> tuple[ObservationRecord, ...]:
        """Return the terms of the observations."""
        if self._tags.observations is not None:
            return self._tags.observations
        names = [EXPORTED.get(name, name) for name in self._listed("observation_names", "observations")]
        for name in names:
            if name not in TERMS:
                raise UnknownName("term", name, TERMS, where=f"{self.place('file')}: observation_names".lstrip(": "))
        return tuple(ObservationRecord.model_validate({"term": name}) for name in names)

    def numbers(
        self, joints: Sequence[str], given: PerJoint | None, key: str, path: tuple[str, ...]
    ) -> np.ndarray | None:
        """Return one number for each joint; None: neither source has them."""
        where = self._tags.where(*path)
        if given is None:
            if key not in self._metadata:
                return None
            where = f"{self.place('file')}: {key}".lstrip(": ")
            given = _floats(_split(self._metadata[key]), key, where)
        if isinstance(given, dict):
            names = list(given)
            _check_names(names, joints, lambda index: self._tags.where(*path, names[index]))
            if missing := [name for name in joints if name not in given]:
                what = f"'{'.'.join(path)}' lacks {', '.join(missing)}"
                raise ComponentError(what, where=where, expected="one number for each joint")
            given = tuple(given[name] for name in joints)
        if isinstance(given, tuple) and len(given) != len(joints):
            what = f"{len(given)} numbers of '{'.'.join(path)}' for {len(joints)} joints"
            raise SizeMismatch(what, where=where, expected="one for all, or one for each joint")
        return np.broadcast_to(np.array(given, dtype=float), len(joints)).copy()

    def _listed(self, key: str, tag: str) -> tuple[str, ...]:
        if found := tuple(map(str, _split(self._metadata.get(key, "")))):
            return found
        what = f"neither the tag `{tag}` nor the metadata `{key}` of '{self._tags.file}' is there"
        raise ComponentError(what, where=self._tags.where(), expected=f"`{tag}` in the network's order")


def _split(text: str) -> list[Any]:
    """Return the parts of a list in the metadata: in JSON, as holosoma writes it, or between commas, as mjlab does."""
    try:
        found = json.loads(text)
        return found if isinstance(found, list) else [found]
    except ValueError:
        return [part.strip() for part in text.split(",") if part.strip()]


def _floats(parts: list[Any], key: str, where: str) -> PerJoint:
    """Return the numbers of a list; a single one counts for all joints."""
    try:
        numbers = tuple(float(part) for part in parts)
    except (TypeError, ValueError) as error:
        raise ComponentError(f"'{key}' are no numbers: {error}", where=where, expected="numbers") from error
    if not numbers or not all(map(math.isfinite, numbers)):
        raise NotFinite(f"'{key}' of the file has a number that is none", where=where, expected="finite numbers")
    return numbers[0] if len(numbers) == 1 else numbers
