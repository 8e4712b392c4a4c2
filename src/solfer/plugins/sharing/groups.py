"""Which plugins of a process share a Robot, and what feeds it (section 2.3 of the paper): one rule for all.

Nothing here needs a Robot: the runtime, `solfer graph` and the log ask the same functions.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from solfer.config import Configuration, ControllerRecord, FeedbackRecord, TextRecord
from solfer.config.kinds.contact import ContactTags
from solfer.errors import PipeError, SolferError
from solfer.robot.defaults import ACTUATED, MODEL_MAPS
from solfer.robot.names import FEEDBACK_MAP, UNACTUATED

Number = tuple[str, str, str]
"""A number of a Robot that pipes write: State, interface, and DoF; or the wrench of a contact."""


def robot_groups(
    configurations: Sequence[Configuration], together: Sequence[str] | None = None
) -> tuple[tuple[Configuration, ...], ...]:
    """Group plugins that share a Robot: in a shared plugin all that are described alike, whatever they receive.

    Plugins that an RT layer lists by themselves may be switched one by one, and have not been asked to work together:
    they share a Robot only if they receive the same as well, and none of them writes it.

    Args:
        configurations: The plugins of one process, after all merging, in the order of their cycles.
        together: Names of the shared plugins that list them, in the same order; empty: none. None: one lists all.
    """
    groups: list[tuple[str, list[Configuration]]] = []
    alone = "shared"  # a process that runs no other shared plugin
    for configuration, shared in zip(configurations, together or [alone] * len(configurations), strict=True):
        known = (found for name, found in groups if name == shared)
        group = next((found for found in known if _fit(found[0], configuration, shared)), None)
        if group is None:
            groups.append((shared, [configuration]))
        else:
            group.append(configuration)
    return tuple(tuple(group) for _, group in groups)


def _fit(one: Configuration, other: Configuration, shared: str) -> bool:
    """Return whether two plugins, which the same shared plugin lists or none, share a Robot."""
    if apart(one, other):
        return False
    return bool(shared) or (_received(one) == _received(other) and not (_writes(one) or _writes(other)))


def _writes(configuration: Configuration) -> bool:
    """Return whether a plugin writes the Robot that it reads, or has filters or alignments that do."""
    return configuration.module.model_change or any(
        record.calibrate or (record.filter is not None and record.filter.run) for record in configuration.feedbacks
    )


def _received(configuration: Configuration) -> list[dict[str, Any]]:
    return [
        origin(record, configuration) | extent(record) for record in configuration.feedbacks if not record.of_plugins
    ]


def apart(one: Configuration, other: Configuration) -> tuple[str, ...]:
    """Return in what the Robots of two plugins differ; empty: they share one."""
    mine = _description(one)
    theirs = _description(other)
    return tuple(name for name in mine if mine[name] != theirs[name])


def origin(record: FeedbackRecord, configuration: Configuration) -> dict[str, Any]:
    """Return all settings of a feedback that determine the numbers which it measures, but for which of them it takes.

    Args:
        record: The feedback.
        configuration: Its plugin's.
    """
    of_plugin = ("name", "layer", "initialize", "timeout", "strikes", "on_timeout", "history")
    of_part = ("dofs", "interface", "limits", "contact", "names")  # they choose some of what its source sends
    own = {key: value for key, value in vars(record).items() if key not in (*of_plugin, *of_part)}
    return own | {
        "source": _plain(record.source),
        "message": record.travels_as,
        "function": record.function or "state",
        "filter": record.filter if record.filter is not None and record.filter.run else None,
        "calibration": configuration.calibrations.get(record.calibration or ""),
        "link": record.measured_link if record.dofs else None,
    }


def extent(record: FeedbackRecord) -> dict[str, Any]:
    """Return the settings of a feedback that choose some of what its source sends."""
    named: dict[str, Any] = {"contacts": record.contacts} if isinstance(record, ContactTags) else {}
    return {key: getattr(record, key) for key in ("dofs", "interface", "limits")} | named


def longest_history(record: FeedbackRecord, configuration: Configuration, group: Iterable[Configuration]) -> int | None:
    """Return the longest `history` of all feedbacks of a group that are read as one with that of `record`."""
    settings = origin(record, configuration) | extent(record)
    lengths = [
        each.history
        for other in group
        for each in other.feedbacks
        if each.history is not None and origin(each, other) | extent(each) == settings
    ]
    return max(lengths, default=None)


@dataclass(frozen=True)
class Writing:
    """A plugin that writes the State of a shared Robot, and a pipe by which it publishes that.

    Attributes:
        plugin: Name of its configuration.
        pipe: Name of the pipe.
    """

    plugin: str
    pipe: str


def writing_of(record: FeedbackRecord, reader: Configuration, group: Iterable[Configuration]) -> Writing | None:
    """Find the other plugin of a group that has written what a feedback receives; None: it has to be received.

    That plugin has `model_change`, and publishes the shared State itself, with all interfaces that are desired and
    without a filter, as the message and on the topic that the feedback names.
    """
    for configuration in group:
        if configuration.module.model_change and configuration.module.name != reader.module.name:
            for pipe in configuration.controllers:
                if record.measures and _publishes(pipe, record):
                    return Writing(configuration.module.name, pipe.name)
    return None


class MeasuredSources:
    """The sources of a shared Robot: two from outside must not feed one number.

    Two are right where one plugin with `model_change` receives one of them, or both: it owns what it makes of that,
    such as the base that an estimator computes from an IMU. What a plugin of the group publishes is not from outside.

    Args:
        group: The plugins that share the Robot.
    """

    def __init__(self, group: Sequence[Configuration]):
        self._inside = {_plain(pipe.sink) for each in group for pipe in each.controllers if not pipe.lower_level}
        self._owned = [
            (origin(record, each), each.module.name)
            for each in group
            if each.module.model_change
            for record in each.feedbacks
            if not record.of_plugins
        ]
        self._first: dict[Number, tuple[dict[str, Any], FeedbackRecord, str]] = {}

    def add(self, record: FeedbackRecord, configuration: Configuration, numbers: Iterable[Number]) -> None:
        """Add a feedback of a plugin, and what it feeds.

        Raises:
            PipeError: Another plugin's feedback feeds one of these numbers from another source.
        """
        source = origin(record, configuration)
        plugin = configuration.module.name
        if source["source"] in self._inside:
            return
        for number in numbers:
            known, other, owner = self._first.setdefault(number, (source, record, plugin))
            if known != source and owner != plugin and len(self._owners(known) | self._owners(source)) != 1:
                raise _two_sources(number, (other, owner), (record, plugin))

    def _owners(self, source: dict[str, Any]) -> set[str]:
        """Return the plugins with `model_change` that receive a source."""
        return {plugin for owned, plugin in self._owned if owned == source}


def numbers_of(record: FeedbackRecord) -> Iterator[Number]:
    """Yield what a feedback feeds as far as that is known without its Robot: parts of chains stand for their DoFs."""
    if isinstance(record, ContactTags):
        yield from (("contact", "wrench", name) for name in record.contacts or ("all",))
        return
    dofs = record.dofs
    body = record.content.body
    parts: tuple[str, ...] = (UNACTUATED,) if body else {"all": ("actuated", UNACTUATED)}.get(dofs.type, (dofs.type,))
    if not body and dofs.mapping in (FEEDBACK_MAP, ACTUATED):  # the orders of what is measured and driven lack a base
        parts = tuple(part for part in parts if part != UNACTUATED)
    chain = "all" if body else dofs.chain
    partial = "" if body or dofs.mapping in (*MODEL_MAPS, FEEDBACK_MAP, ACTUATED) else f" in {dofs.mapping}"
    for interface in record.interface.carried:
        for part in parts:
            yield record.function or "state", interface, f"{part} of {chain}{partial}"


def conflicts(
    group: Sequence[Configuration],
    numbers: Callable[[FeedbackRecord], Iterable[Number]] = numbers_of,
    received: Callable[[Configuration], Iterable[FeedbackRecord]] = lambda each: each.feedbacks,
) -> list[SolferError]:
    """Return an error for each feedback of a group that feeds a number which another source feeds, too."""
    sources = MeasuredSources(group)
    errors = list[SolferError]()
    for configuration in group:
        for record in received(configuration):
            if record.of_plugins:
                continue
            try:
                sources.add(record, configuration, numbers(record))
            except PipeError as error:
                errors.append(error)
    return errors


def _two_sources(number: Number, first: tuple[FeedbackRecord, str], second: tuple[FeedbackRecord, str]) -> PipeError:
    function, interface, dof = number
    sides = {"state": "measured ", "motor": "motor side's "}
    (other, owner), (record, plugin) = first, second
    what = f"the wrench of contact '{dof}'" if function == "contact" else f"the {sides[function]}{interface} of '{dof}'"
    same = _plain(other.source) == _plain(record.source)
    difference = "with other settings from the same topic" if same else f"from '{_plain(record.source)}'"
    return PipeError(
        f"{what} has two sources: '{plugin}' receives it by '{record.name}' {difference}, '{owner}', "
        f"which shares its Robot, by '{other.name}' from '{_plain(other.source)}'",
        where=record.where("source"),
        expected=f"one source for both, as in {other.where('source')}, or one plugin with model_change that receives "
        "either of them",
    )


def _description(configuration: Configuration) -> dict[str, Any]:
    """Return what plugins that share a Robot have in common, by the words of `apart`."""
    sources = configuration.sources
    robot = configuration.robot
    actuators = robot.actuators.read
    contacts = robot.contacts.read
    return {
        "model": (robot.name, _text(sources.urdf), _text(sources.srdf)),
        "system": configuration.system,
        "rate": configuration.rate,
        "maps": [_map(configuration.mappings[name]) for name in sorted(configuration.mappings)],
        "actuators": (actuators, _text(sources.actuators) if actuators else None),
        "contacts": (contacts, _text(sources.contacts) if contacts else None),
    }


def _map(record: Any) -> tuple[Any, ...]:
    return record.name, record.loading, record.source, record.message, _text(record.urdf)


def _text(record: TextRecord | None) -> tuple[Any, ...] | None:
    return None if record is None else (record.parameter, record.location)


def _publishes(pipe: ControllerRecord, record: FeedbackRecord) -> bool:
    """Return whether a command pipe publishes what a feedback receives, as it stands in the State."""
    return (
        not pipe.lower_level
        and pipe.function == (record.function or "state")
        and _plain(pipe.sink) == _plain(record.source)
        and pipe.travels_as == record.travels_as
        and not any(each.filter is not None and each.filter.run for each in (pipe, record))
        and pipe.calibration is None is record.calibration
        and not isinstance(pipe, ContactTags)
        and pipe.space == record.space
        and record.history is None
        and set(record.interface.carried) <= set(pipe.interface.carried)
    )


def _plain(topic: str | None) -> str:
    return (topic or "").lstrip("/")
