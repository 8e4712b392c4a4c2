"""Changes parameters of a component while it runs: a request counts as a whole, and in small steps."""

import json
import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic.fields import FieldInfo

from solfer.components.base import Component
from solfer.config import Record
from solfer.config.records.live import LiveField, Path, live_fields, revised, value_at
from solfer.config.yaml.nodes import dotted
from solfer.errors import ComponentError, Overtaken, SizeMismatch, SolferError, UnknownName, described, singles
from solfer.interfaces.declaration import Accepted, LiveParameter, Service
from solfer.transport.parameters import (
    GET_INTERFACE,
    GET_PARAMETERS,
    SET_INTERFACE,
    SET_PARAMETERS,
    GetParameters,
    ParametersReply,
    SetParameters,
)

logger = logging.getLogger(__name__)

RAMP = 0.5
"""Time in which numbers move to new ones [s]."""

MOVING_PARAMETERS = 2
"""Most parameters that move in one cycle; more of them take turns."""

WAITING_CHANGES = 1000
"""Most changes that wait to be logged."""


_Goal = tuple[np.ndarray, bool]
"""Numbers, and whether all of them are finite."""


class _Motion:
    """Numbers that count now, while they move to others.

    Args:
        write: Takes over numbers.
        numbers: Those that count first.

    Attributes:
        numbers: Those that count now.
        goal: Where they are to be, taken over when they have their next turn; None: they are on their way there.
        since: When they began their way [s].
    """

    def __init__(self, write: Callable[[np.ndarray], None], numbers: np.ndarray):
        self.numbers = numbers
        self.since = 0.0
        self.goal: _Goal | None = None
        self._write = write
        self._begin = numbers
        self._ramp = np.zeros_like(numbers)
        self._is_finite = bool(np.isfinite(numbers).all())

    def go_on(self, time: float) -> bool:
        """Let the numbers be where they are to be at some time [s]; return whether they still move."""
        if self.goal is not None:
            (goal, is_finite), begin, self.goal = self.goal, self.numbers, None
            has_ramp = self._is_finite and is_finite
            self._begin, self._ramp = (begin, goal - begin) if has_ramp else (goal, np.zeros_like(goal))
            self._is_finite = is_finite
        share = (time - self.since) / RAMP
        self.numbers = self._begin + min(share, 1.0) * self._ramp
        self._write(self.numbers)
        return share < 1.0


@dataclass(frozen=True)
class _Knob:
    """A parameter; None: nothing of it moves."""

    parameter: LiveParameter
    field: LiveField
    motion: _Motion | None


@dataclass(frozen=True)
class _Change:
    """A request that fits.

    Attributes:
        before: The tags that it changes.
        after: The tags that it leads to.
        goals: What moves, and where to.
        writes: What takes the new tags over at once.
        lines: Name, old and new value of each parameter that changes.
    """

    before: Record
    after: Record
    goals: tuple[tuple[_Motion, _Goal], ...]
    writes: tuple[Callable[[Any], None], ...]
    lines: tuple[tuple[str, Any, Any], ...]


class Tuning:
    """The live parameters of a component.

    A request is checked where it arrives, outside of the cycle, by making the tags that it leads to. Between two cycles
    these become the component's, for its next start as well. Numbers move to new ones within `RAMP`, one row at a time
    as the others, in `advance`.

    Args:
        component: The component; its rate is set.
        parameters: Its live parameters.

    Attributes:
        moves: Whether numbers are on their way, so that `advance` has something to do.

    Raises:
        ComponentError: A parameter is no field that is marked as live.
    """

    def __init__(self, component: Component, parameters: Sequence[LiveParameter]):
        self._component = component
        tags = component.tags
        fields = dict(live_fields(tags)) if isinstance(tags, Record) else {}
        self._knobs: dict[str, _Knob] = {}
        motions: dict[Callable[[Any], None], _Motion] = {}
        for each in parameters:
            field = LiveField.of(_field(fields, each.path))
            if each.numbers is not None and each.write not in motions:
                motions[each.write] = _Motion(each.write, np.array(each.numbers(tags), dtype=float))
            self._knobs[dotted(each.path)] = _Knob(each, field, motions.get(each.write))
        self.moves = False
        self._moving: dict[_Motion, None] = {}
        self._time = 0.0
        self._configured = self._newest = tags
        self._lock = threading.Lock()
        self._unsaid: deque[tuple[tuple[str, Any, Any], ...]] = deque(maxlen=WAITING_CHANGES)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self._knobs)

    def setting(self) -> Service:
        """Make the service `<plugin>/set_parameters`."""
        return Service(
            SET_PARAMETERS,
            SET_INTERFACE,
            SetParameters,
            reply=Accepted,
            handler=self._carry_out,
            prepare=self._prepare,
            quick=True,
            commands=False,
        )

    def getting(self) -> Service:
        """Make the service `<plugin>/get_parameters`."""
        return Service(
            GET_PARAMETERS,
            GET_INTERFACE,
            GetParameters,
            reply=ParametersReply,
            handler=lambda reply: reply,
            prepare=self._describe,
            quick=True,
        )

    def begin(self, setting: Service, values: Mapping[str, Any]) -> None:
        """Begin with other values than those of the files, if all of them fit; before the first start.

        Args:
            setting: That of `setting`, which notes the request.
            values: Values by name.
        """
        texts = ("" if value == "" else json.dumps(value, default=str) for value in values.values())
        try:
            setting.prepared(SetParameters(tuple(values), tuple(texts)))()
        except (SolferError, ValueError, RecursionError) as error:
            logger.warning(
                "%s: first values of parameters are refused: %s", self._component.name, described(error, lines=True)
            )
        self.finish()
        self.log()

    def advance(self, step: float) -> None:
        """Move numbers on by `step` [s]; where `moves` is False there is nothing to do."""
        self._time += step
        moving = self._moving
        for _ in range(min(len(moving), MOVING_PARAMETERS)):
            motion = next(iter(moving))
            del moving[motion]
            if motion.go_on(self._time):
                moving[motion] = None
        self.moves = bool(moving)

    def finish(self) -> None:
        """Let all numbers be where they are to be, before a start; requests that were not carried out are forgotten."""
        for motion in self._moving:
            motion.go_on(np.inf)
        self._moving.clear()
        self.moves = False
        self._newest = self._component.tags

    def log(self) -> None:
        """Log what has changed since the last call, outside of the cycle: a line for each parameter."""
        changes: dict[str, tuple[Any, Any, int]] = {}
        while self._unsaid:
            for name, old, new in self._unsaid.popleft():
                first, _, count = changes.get(name, (old, new, 0))
                changes[name] = first, new, count + 1
        for name, (old, new, count) in changes.items():
            above, _, key = name.rpartition(".")
            what = f"{key} of {above}" if above else key
            values = (_text(each) or "none" for each in (old, new))
            often = f" ({count} changes)" if count > 1 else ""
            logger.info("%s: %s %s -> %s%s", self._component.name, what, *values, often)

    def _prepare(self, request: SetParameters) -> _Change:
        """Check a request and make the tags that it leads to; nothing changes.

        Raises:
            SolferError: Something is wrong with it.
            SolferErrors: Several things are.
        """
        names = request.names
        if len(names) != len(request.values):
            raise SizeMismatch(f"{len(request.values)} values for {len(names)} parameters", expected="one for each")
        for name in names:
            if name not in self._knobs:
                raise UnknownName("parameter", name, self._knobs)
            if names.count(name) > 1:
                raise ComponentError(f"parameter '{name}' is given twice", expected="each parameter once")
        knobs = [self._knobs[name] for name in names]
        with self._lock:
            before = self._newest
            values = {knob.parameter.path: text for knob, text in zip(knobs, request.values, strict=True)}
            try:
                after = revised(before, values) if values else before
            except SolferError as error:
                raise self._explained(error) from None
            change = self._change(names, before, after)
            self._newest = after
        return change

    def _change(self, names: Sequence[str], before: Record, after: Record) -> _Change:
        """Collect what a request changes.

        Raises:
            SolferError: Numbers do not fit, or they are too many.
        """
        goals: dict[_Motion, _Goal] = {}
        writes: dict[Callable[[Any], None], None] = {}
        lines = []
        for name in names:
            knob = self._knobs[name]
            old, new = (self._value(tags, knob) for tags in (before, after))
            if old == new:
                continue
            lines.append((name, old, new))
            if knob.motion is None or knob.parameter.numbers is None:
                writes[knob.parameter.write] = None
                continue
            try:
                numbers = np.array(knob.parameter.numbers(after), dtype=float)
            except SolferError as error:
                raise error.at(name) from None
            goals[knob.motion] = numbers, bool(np.isfinite(numbers).all())
        most = 16
        if len(lines) > most:
            raise ComponentError(f"{len(lines)} parameters change at once", expected=f"at most {most} in a request")
        return _Change(before, after, tuple(goals.items()), writes=tuple(writes), lines=tuple(lines))

    def _explained(self, error: SolferError) -> SolferError:
        """Add the range of the parameter that an error is about."""
        for each in singles([error]):
            knob = self._knobs.get(each.where)
            if knob is not None and not each.expected:
                each.expected = _range(knob.field)
        return error

    def _carry_out(self, change: _Change) -> Accepted:
        """Take a change over; between two cycles."""
        component = self._component
        if change.before is not component.tags:
            self._newest = component.tags
            raise Overtaken("another request has changed parameters meanwhile", expected="the same request once again")
        component.tags = change.after
        self._unsaid.append(change.lines)
        for motion, goal in change.goals:
            motion.goal = goal
            motion.since = self._time
            self._moving[motion] = None
        self.moves = bool(self._moving)
        for write in change.writes:
            write(change.after)
        return Accepted()

    def _describe(self, request: GetParameters) -> ParametersReply:
        for name in request.names:
            if name not in self._knobs:
                raise UnknownName("parameter", name, self._knobs)
        tags = self._component.tags
        names = request.names or self.names
        rows = [self._description(name, self._knobs[name], tags) for name in names]
        return ParametersReply(True, "", *zip(*rows, strict=True))

    def _description(self, name: str, knob: _Knob, tags: Record) -> tuple[str, ...]:
        """Return the texts of a parameter, in the order of a `ParametersReply`."""
        field = knob.field
        value, configured = (_text(self._value(each, knob)) for each in (tags, self._configured))
        default = _text(field.default)
        return name, field.kind, value, configured, default, field.unit, field.minimum, field.maximum, field.description

    @staticmethod
    def _value(tags: Record, knob: _Knob) -> Any:
        value = value_at(tags, knob.parameter.path)
        return knob.field.default if value is None else value


def _field(fields: dict[Path, FieldInfo], path: Path) -> FieldInfo:
    """Find the field that a path leads to; a field that holds a map has parameters below it."""
    for length in range(len(path), 0, -1):
        if path[:length] in fields:
            return fields[path[:length]]
    raise ComponentError(f"the tag '{dotted(path)}' is not live", expected="a field that is marked LIVE")


def _range(field: LiveField) -> str:
    """Describe the values that a parameter may have."""
    bounds = " to ".join(filter(None, (field.minimum, field.maximum)))
    return ", ".join(filter(None, (field.kind, bounds))) + (f" [{field.unit}]" if field.unit else "")


def _text(value: Any) -> str:
    return "" if value is None else value if isinstance(value, str) else json.dumps(value).removesuffix(".0")
