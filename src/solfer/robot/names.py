"""Names that a configuration uses and only a robot has: groups, links, joints, states, and maps."""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from solfer.config import CalibrationRecord, Configuration, DofsRecord, FeedbackRecord, Problems, Record
from solfer.config.records.middlewares import MIDDLEWARES, PREDEFINED_MAPS
from solfer.config.records.robot_names import names_in
from solfer.config.yaml.nodes import Key
from solfer.errors import ConfigError
from solfer.model import Description, Semantics
from solfer.robot.defaults import ACTUATED, ALL, MODEL_MAPS
from solfer.robot.robot import Robot

FEEDBACK_MAP, LOWER_LEVEL_MAP = "FEEDBACK", "LOWER_LEVEL"
"""Names of the maps of the default state feedback, and of all lower-level controllers."""

LOWER_LEVEL_MAPS = (LOWER_LEVEL_MAP, *PREDEFINED_MAPS)
"""Maps that stand for the one of a controller in a pipe to it."""

UNACTUATED = "unactuated"
"""Type of the DoFs of a floating base."""

_SELECTIONS = ("all", "actuated", UNACTUATED, "body")  # values of `dofs.type` beside the names of maps


@dataclass(frozen=True)
class RobotNames:
    """Names of a robot's parts.

    Attributes:
        group: Groups of the SRDF, and `all`; None if they are not known.
        link: Links.
        joint: Joints.
        state: Named states of the SRDF; None if they are not known.
        moved: Links that joints move against the base.
    """

    group: Collection[str] | None
    link: Collection[str]
    joint: Collection[str]
    state: Collection[str] | None
    moved: Collection[str] = ()

    @classmethod
    def of_robot(cls, robot: Robot, others: Collection[Description] = ()) -> "RobotNames":
        """Collect the names of a Robot, and the joints of `others`."""
        joints = {*robot.dofs, *robot.description.joints, *(joint for other in others for joint in other.joints)}
        moved = _moved(robot.description)
        return cls(robot.selectors, robot.description.links, joints, state=robot.semantics.states, moved=moved)

    @classmethod
    def of_files(cls, urdf: Path, srdf: Path | None, others: Collection[Path] = ()) -> "RobotNames":
        """Read the names in a URDF and an SRDF; `others` are URDFs of models with names that the first one lacks.

        Raises:
            SolferError: A file cannot be read, or does not contain a robot.
        """
        first, *rest = [Description.from_file(path) for path in (urdf, *others)]
        links = dict(first.links)
        joints = dict(first.joints)
        for model in rest:
            links = {**links, **model.links}
            joints = {**joints, **model.joints}
        moved = _moved(first)
        if srdf is None:
            return cls(None, tuple(links), tuple(joints), state=None, moved=moved)
        semantics = Semantics.from_file(srdf, first, rest)
        return cls((ALL, *semantics.groups), tuple(links), tuple(joints), state=tuple(semantics.states), moved=moved)


def controller_map(controller: str) -> str:
    """Return the name of the map between a Robot and a lower-level controller."""
    return f"ros_control::{controller}"


def check_names(
    configuration: Configuration,
    names: RobotNames,
    problems: Problems,
    tags: Record | None = None,
    dofs: Collection[DofsRecord] | None = None,
) -> None:
    """Note each name in a configuration that the robot does not have, at its place.

    Args:
        configuration: One module, merged; parts of it may be missing because of other mistakes.
        names: The robot's names.
        problems: Receives the mistakes.
        tags: The component's own tags.
        dofs: DoFs of the pipes; by default those of the configuration.
    """
    records = [*configuration.feedbacks, *configuration.controllers]
    maps = tuple(_maps(configuration))
    for item in [record.dofs for record in records] if dofs is None else dofs:
        if item is not None:
            _check_dofs(item, names, maps, problems=problems)
    for record in records:
        check_tags(record, names, problems)
    _check_order(configuration.feedbacks, names, problems)
    _check_rivals(configuration.feedbacks, problems)
    used = dict.fromkeys(record.calibration for record in records)
    check_calibrations([record for name, record in configuration.calibrations.items() if name in used], names, problems)
    if tags is not None:
        check_tags(tags, names, problems)


def check_tags(tags: Record, names: RobotNames, problems: Problems) -> None:
    """Note each name in the tags of a component, or of a pipe, that the robot does not have."""
    for place, key, kind, name in names_in(tags):
        _check(place, key, kind, name=name, known=getattr(names, kind), problems=problems)


def check_calibrations(calibrations: Iterable[CalibrationRecord], names: RobotNames, problems: Problems) -> None:
    """Note each joint of a calibration that the robot does not have."""
    for calibration in calibrations:
        for joint, record in calibration.joints.items():
            _check(record, None, "joint", name=joint, known=names.joint, problems=problems)


def _moved(description: Description) -> set[str]:
    joints = [joint for joint in description.joints.values() if joint.type not in ("fixed", "floating")]
    return {link for joint in joints for link in description.subtree(joint.child)}


def _check_order(feedbacks: Iterable[FeedbackRecord], names: RobotNames, problems: Problems) -> None:
    """Warn of pipes that compute the base from a link which joints move, before those joints are read."""
    early: list[FeedbackRecord] = []
    for record in feedbacks:
        if record.measured_link in names.moved:
            early.append(record)
        elif record.content.joints and record.dofs.type != UNACTUATED:
            for body in early:
                if (body.function or "state") == record.function:
                    problems.warn(
                        body.place(),
                        f"'{body.name}' is read before '{record.name}', whose joints it needs: "
                        "it uses those of the previous cycle",
                    )


def _check_rivals(feedbacks: Iterable[FeedbackRecord], problems: Problems) -> None:
    """Note feedbacks of rigid bodies that measure the same of the base of one State: the later one would count alone.

    Each of them has an orientation in its positions and an angular velocity in its velocities.
    """
    first: dict[tuple[str, str], FeedbackRecord] = {}
    for record in feedbacks:
        if not record.content.body:
            continue
        for interface in ("position", "velocity"):
            if not getattr(record.interface, interface):
                continue
            rival = first.setdefault((record.function or "state", interface), record)
            if rival is not record:
                mark = record.interface.place(interface)
                problems.put(
                    mark,
                    ConfigError(
                        f"the feedbacks '{rival.name}' ({rival.interface.where(interface)}) and '{record.name}' "
                        f"both set the '{interface}' of the floating base",
                        where=str(mark),
                        expected=f"one of them, or `{interface}: false` in the other",
                    ),
                )


def _maps(configuration: Configuration) -> Iterator[str]:
    """Yield the names of the maps that a Robot gets from its configuration."""
    yield from (*MODEL_MAPS, ACTUATED, FEEDBACK_MAP, LOWER_LEVEL_MAP)
    predefined = configuration.tree.get(configuration.section, "mapping")
    yield from (name for name, _ in predefined.items()) if predefined else ()
    order = MIDDLEWARES[configuration.middleware].map
    if order is not None:
        yield order
    for record in configuration.controllers:
        if record.lower_level:
            yield controller_map(record.leads_to)


def _check_dofs(dofs: DofsRecord, names: RobotNames, maps: Collection[str], problems: Problems) -> None:
    _check(dofs, "chain", "group", name=dofs.chain, known=names.group, problems=problems)
    _check(dofs, "mapping", "map", name=dofs.mapping, known=maps, problems=problems)
    if dofs.type == "body":
        _check(dofs, "name", "link", name=dofs.name or "", known=names.link, problems=problems)
    else:
        _check(dofs, "type", "type of DoFs", name=dofs.type, known=(*_SELECTIONS, *maps), problems=problems)


def _check(
    record: Record, key: Key | None, kind: str, name: str, known: Collection[str] | None, *, problems: Problems
) -> None:
    if known is None or name in known:
        return
    problems.unknown(record.place() if key is None else record.place(key), kind, name, known)
