"""Tags of the original program's stacks of tasks, and what they mean as a `StackRecord`."""

import logging
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field

from solfer.config.records.bounds import Name
from solfer.config.records.live import LIVE
from solfer.config.records.record import Record
from solfer.config.records.robot_names import NameOf
from solfer.config.tasks.limits import StackLimitsRecord, WorkspaceRecord
from solfer.config.tasks.stack import Gain, StackRecord, TaskRecord
from solfer.errors import ConfigError, UnknownName

logger = logging.getLogger(__name__)

_DAMPING_SUFFIX = "_DAMP"
Solver = Literal["null_spaces", "qp"]


class OriginalTaskTags(Record):
    """Tags of tasks by priority as the original program has them."""

    ik: tuple[str, ...] | None = Field(
        default=None,
        alias="IK",
        min_length=1,
        description="original: tasks by priority, `ARMS` or `ns::ARMS` by null spaces, `qp::ARMS` by QPs",
    )
    tunning: Name | None = Field(default=None, description="original: the one of `tunnings` that counts")
    tunnings: dict[str, dict[str, Gain | tuple[Gain, ...]]] | None = Field(
        default=None, **LIVE, description="original: gains by task [1/s], twice as fast in a QP, and dampings, by name"
    )


class OriginalStackTags(OriginalTaskTags):
    """Tags of a stack of tasks as the original program has them; for a new one, there is `stack`."""

    chain: Annotated[Name | None, NameOf("group")] = Field(
        default=None, description="original: SRDF group of the joints that move"
    )
    track: Annotated[Name | None, NameOf("group")] = Field(
        default=None, description="original: SRDF group of the hands' links"
    )
    reference: Name | None = Field(
        default=None, description="original: link that the hands are seen from, world axes, or `world`"
    )
    workspace_init: Annotated[Name | None, NameOf("group")] = Field(
        default=None, description="original: SRDF group of the links that the hands stay near, in order"
    )

    @property
    def has_stack(self) -> bool:
        """Whether a stack of the original is described."""
        return self.ik is not None


def parts_of_tuning(tags: OriginalTaskTags, record: StackRecord) -> list[str]:
    """List the gains and dampings of the tuning that counts, of tasks of `record`, which was made of the tags."""
    gains = (tags.tunnings or {}).get(str(tags.tunning), {})
    return [name for name in gains if name == "damping" or name.removesuffix(_DAMPING_SUFFIX) in record.tasks]


def hands(tags: OriginalStackTags) -> StackRecord:
    """Translate the tags of the original's hands: `IK` with the task `ARMS` alone.

    Raises:
        ConfigError: A tag is missing, or contradicts another.
        UnknownName: There is no such task, tuning or kind.
    """
    for key in ("track", "reference"):
        if getattr(tags, key) is None:
            raise ConfigError(f"the key '{key}' is missing", where=tags.where(), expected=_description(key))
    seen: dict[str, Any] = {} if tags.reference == "world" else {"relative": tags.reference, "axes": "world"}
    task = TaskRecord(point="position", link=tags.track, **seen)
    limits = StackLimitsRecord()
    if tags.workspace_init is not None:
        if tags.workspace_init == tags.track:
            raise ConfigError(
                f"'{tags.track}' is to stay near itself", where=tags.where("workspace_init"), expected="another group"
            )
        reach = math.sqrt(0.53)  # [m] of a hand from its base; the original limits its square
        workspace = WorkspaceRecord(link=tags.track, relative=tags.workspace_init, farthest=reach).placed_as(tags)
        limits = StackLimitsRecord(workspace={"ARMS": workspace})
    return translated(tags, {"ARMS": task}, limits=limits, chain=tags.chain)


def translated(
    tags: OriginalTaskTags,
    known: Mapping[str, TaskRecord],
    sums: Mapping[str, Sequence[str]] | None = None,
    limits: StackLimitsRecord | None = None,
    chain: str | None = None,
) -> StackRecord:
    """Translate tags of the original: each task of `IK` is a level, `qA::NAME` one of several tasks.

    In a QP the original's tasks are twice as fast as their gain, and their damping is that of J'J; by null spaces it is
    squared. Limits count in QPs alone.

    Args:
        tags: The tags.
        known: Tasks by the original's names, without gains.
        sums: Names of tasks that `qA::NAME` sums, by NAME.
        limits: Limits of QPs.
        chain: SRDF group of the DoFs that move; None: all.

    Raises:
        ConfigError: A tag is missing, or contradicts another.
        UnknownName: There is no such task, tuning or kind.
    """
    levels, solver = _levels(tags, known, sums or {})
    gains = _tuning(tags, known)
    # the cost of the original's QPs has 1/2 x'Hx, but 2 J'Ke
    factor, damping = (2.0, math.sqrt) if solver == "qp" else (1.0, float)
    tasks = {}
    for name in dict.fromkeys(name for level in levels for name in level):
        if name not in gains:
            raise ConfigError(
                f"the tuning '{tags.tunning}' has no gain of '{name}'",
                where=tags.where("tunnings", str(tags.tunning)),
                expected=f"a number or a list of them as '{name}'",
            )
        gain = gains[name]
        damp = gains.get(name + _DAMPING_SUFFIX, gains.get("damping"))
        if not isinstance(damp, float) or damp <= 0.0:
            raise ConfigError(
                f"the tuning '{tags.tunning}' has no damping of '{name}'",
                where=tags.where("tunnings", str(tags.tunning)),
                expected=f"a positive number as 'damping' or '{name}{_DAMPING_SUFFIX}'",
            )
        doubled = tuple(factor * each for each in gain) if isinstance(gain, tuple) else factor * gain
        own = {"gain": doubled, "damping": damping(damp)} | ({"dofs": (chain,)} if chain else {})
        tasks[name] = TaskRecord(**{**known[name].model_dump(exclude_unset=True), **own}).placed_as(tags)
    kept = (limits or StackLimitsRecord()) if solver == "qp" else StackLimitsRecord()
    return StackRecord(solver=solver, tasks=tasks, levels=levels, limits=kept.placed_as(tags)).placed_as(tags)


def _levels(
    tags: OriginalTaskTags, known: Mapping[str, TaskRecord], sums: Mapping[str, Sequence[str]]
) -> tuple[tuple[tuple[str, ...], ...], Solver]:
    """Read `IK`: the names of the tasks of each level, and the solver."""
    solver_of: dict[str, Solver] = {"": "null_spaces", "ns": "null_spaces", "qp": "qp", "qA": "qp"}
    levels = []
    solvers = []
    for index, entry in enumerate(tags.ik or ()):
        kind, _, name = entry.rpartition("::")
        where = tags.where("IK", index)
        if kind not in solver_of:
            raise UnknownName("kind of a task", kind, [one for one in solver_of if one], where=where)
        solvers.append(solver_of[kind])
        if kind == "qA" and name not in sums:
            raise UnknownName("sum of tasks", name, sums, where=where)
        names = tuple(sums[name]) if kind == "qA" else (name,)
        for one in names:
            if one not in known:
                raise UnknownName("task", one, known, where=where)
        levels.append(names)
    if not levels:
        raise ConfigError("the key 'IK' is missing", where=tags.where(), expected=_description("ik"))
    if len(set(solvers)) > 1:
        raise ConfigError("tasks by null spaces beside tasks by QPs", where=tags.where("IK"), expected="one of the two")
    return tuple(levels), solvers[0]


def _tuning(tags: OriginalTaskTags, known: Mapping[str, TaskRecord]) -> Mapping[str, float | tuple[float, ...]]:
    """Return gains and dampings of the tuning that counts."""
    tunings = tags.tunnings or {}
    if tags.tunning is None or tags.tunning not in tunings:
        raise UnknownName("tuning", str(tags.tunning or ""), tunings, where=tags.where("tunning"))
    gains = tunings[tags.tunning]
    names = ["damping", *known, *(name + _DAMPING_SUFFIX for name in known)]
    for name in gains:
        if name in ("ratio", "COP"):
            logger.warning("%s: has no effect: nothing reads it, in the original neither", _place(tags, name))
        elif name not in names:
            raise UnknownName("task of a tuning", name, names, where=_place(tags, name))
    return gains


def _place(tags: OriginalTaskTags, name: str) -> str:
    return tags.where("tunnings", str(tags.tunning), name)


def _description(key: str) -> str:
    return (OriginalStackTags.model_fields[key].description or "").removeprefix("original: ")
