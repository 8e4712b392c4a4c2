"""What a network and a robot agree on: joints by name, terms and widths of observations, actions and gains."""

import json
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from solfer.components.policy.exported import RANGES, exported_tags, term_of
from solfer.components.policy.network import PolicyNetwork
from solfer.components.policy.tags import ActionRecord, CommandRangeRecord, ObservationRecord, PerJoint, PolicyTags
from solfer.config import Record
from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.robot import Robot

BASE_TERMS = ("angular_velocity", "projected_gravity", "linear_velocity")
"""Terms of a floating base."""

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
        history_order: Order of their histories.
        action: What actions are.
        scale: Factors of the actions, shape (m,).
        bounds: Smallest and largest of what the actions become, shape (2, m).
        commands: Smallest and largest commanded velocity, x, y [m/s] and yaw rate [rad/s], shape (2, 3).
        rate: The network's rate [Hz].
        gains: Stiffness [Nm/rad, N/m] and damping [Nms/rad, Ns/m] by name, shape (m,); without those of neither source.
    """

    joints: tuple[str, ...]
    dofs: np.ndarray
    default: np.ndarray
    terms: tuple[ObservationRecord, ...]
    history_order: str
    action: ActionRecord
    scale: np.ndarray
    bounds: np.ndarray
    commands: np.ndarray
    rate: float
    gains: Mapping[str, np.ndarray]


def agree(tags: PolicyTags, network: PolicyNetwork, robot: Robot) -> PolicyContract:
    """Make the contract of tags, of the file that was exported, and of the network's metadata, in this precedence.

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
    terms = source.terms()
    history_order = source.value("history_order")
    _check_terms(terms, len(joints), network, robot=robot, where=source.place("observations"))
    if history_order != "terms" and len({term.history for term in terms}) > 1:
        what = "histories of different lengths, whose steps stand together"
        raise SizeMismatch(what, where=source.place("history_order"), expected="one `history` of all terms")
    default = source.numbers(joints, "default_joint_pos", path=("default",))
    if default is None:
        what = f"neither the tag `default` nor '{tags.file}' has a default pose"
        raise ComponentError(what, where=tags.where(), expected="`default`: one position for each joint")
    scale = source.numbers(joints, "action_scale", path=("action", "scale"))
    bounds = np.full((2, len(joints)), ((-np.inf,), (np.inf,)))
    for row, end in zip(bounds, ("lower", "upper"), strict=True):
        if (found := source.numbers(joints, "", path=("action", end))) is not None:
            row[:] = found
    if (bounds[0] > bounds[1]).any():
        joint = joints[int((bounds[0] > bounds[1]).argmax())]
        what = f"the bounds of the actions of '{joint}' have the larger one first"
        raise ComponentError(what, where=source.place("action", "lower"), expected="`lower` below `upper`")
    gains = {name: source.numbers(joints, f"joint_{name}", path=("gains", name)) for name in ("stiffness", "damping")}
    for name, numbers in gains.items():
        if numbers is not None and not (numbers >= 0.0).all():
            where = source.place("gains", name)
            raise ComponentError(f"a {name} of {numbers.min():g}", where=where, expected="numbers from zero on")
    return PolicyContract(
        joints,
        dofs,
        default,
        terms=terms,
        history_order=history_order,
        action=source.action(),
        scale=np.ones(len(joints)) if scale is None else scale,
        bounds=bounds,
        commands=source.commands(),
        rate=source.value("rate"),
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
    """Tags, the tags of an exported file where these leave something out, and the metadata where both do."""

    def __init__(self, tags: PolicyTags, metadata: Mapping[str, str]):
        self._tags = tags
        exported = exported_tags(tags)
        self._records = (tags,) if exported is None else (tags, exported)
        others = {key: metadata[other] for key, other in KEYS.items() if other in metadata}
        self._metadata = others | dict(metadata)

    def _record(self, *path: str) -> PolicyTags | None:
        """Return the first record in which a value is given."""
        for record in self._records:
            part: Any = record
            for key in path:
                if isinstance(part, dict):
                    part = part.get(key)
                else:
                    part = getattr(part, key) if isinstance(part, Record) and key in part.model_fields_set else None
            if part is not None:
                return record
        return None

    def place(self, *path: str | int) -> str:
        """Return the place of a value, or of the network's file if it is left out."""
        record = self._record(*(key for key in path if isinstance(key, str)))
        return self._tags.where("file") if record is None else record.where(*path)

    def value(self, *path: str) -> Any:
        """Return a value of the tags; the default one, if it is left out."""
        found: Any = self._record(*path) or self._tags
        for key in path:
            found = getattr(found, key)
        return found

    def action(self) -> ActionRecord:
        """Return what actions are."""
        return ActionRecord(**{key: self.value("action", key) for key in ("kind", "springs", "clip")})

    def commands(self) -> np.ndarray:
        """Return the smallest and the largest commanded velocity, shape (2, 3)."""
        if self._record("command_range") is None and "command_ranges" in self._metadata:
            where = f"{self.place('file')}: command_ranges".lstrip(": ")
            ranges = _ranges(self._metadata["command_ranges"], where)
        else:
            ranges = self.value("command_range") or CommandRangeRecord()
        return np.array((ranges.x, ranges.y, ranges.yaw)).T.copy()

    def joints(self) -> tuple[str, ...]:
        """Return the names of the joints."""
        return self.value("joints") or self._listed("joint_names", "joints")

    def terms(self) -> tuple[ObservationRecord, ...]:
        """Return the terms of the observations."""
        if (found := self.value("observations")) is not None:
            return found
        where = f"{self.place('file')}: observation_names".lstrip(": ")
        names = [term_of(name, where) for name in self._listed("observation_names", "observations")]
        return tuple(ObservationRecord.model_validate({"term": name}) for name in names)

    def numbers(self, joints: Sequence[str], key: str, path: tuple[str, ...]) -> np.ndarray | None:
        """Return one number for each joint, of the tag at `path` or of the metadata; None: none has them."""
        record = self._record(*path)
        given = self.value(*path)
        where = self.place(*path)
        if record is None:
            if key not in self._metadata:
                return None
            where = f"{where}: {key}".lstrip(": ")
            given = _floats(_split(self._metadata[key]), key, where)
        if isinstance(given, dict):
            names = list(given)
            _check_names(names, joints, lambda index: self.place(*path, names[index]))
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


def _ranges(text: str, where: str) -> CommandRangeRecord:
    """Return the ranges of commands in the metadata, as holosoma writes them."""
    try:
        found = json.loads(text)
        ranges = {key: found[name] for key, names in RANGES.items() for name in names if name in found}
        return CommandRangeRecord.model_validate_json(json.dumps(ranges))
    except (TypeError, ValueError) as error:
        what = f"'command_ranges' of the file are no ranges: {str(error).partition(chr(10))[0]}"
        raise ComponentError(what, where=where, expected='{"lin_vel_x": [-1.0, 1.0], ...}') from error


def _floats(parts: list[Any], key: str, where: str) -> PerJoint:
    """Return the numbers of a list; a single one counts for all joints."""
    try:
        numbers = tuple(float(part) for part in parts)
    except (TypeError, ValueError) as error:
        raise ComponentError(f"'{key}' are no numbers: {error}", where=where, expected="numbers") from error
    if not numbers or not all(map(math.isfinite, numbers)):
        raise NotFinite(f"'{key}' of the file has a number that is none", where=where, expected="finite numbers")
    return numbers[0] if len(numbers) == 1 else numbers
