"""One tree of errors: what is wrong, where, what was expected, and the nearest valid names.

Every mistake that a user can make ends as a `SolferError`; the nodes and the command line print it in one block and
exit with code 2. Third-party exceptions stop at the border of the room that meets them.
"""

import difflib
from collections.abc import Iterable, Sequence


def nearest(name: str, names: Iterable[str], count: int = 3) -> list[str]:
    """The `count` names most like `name`, best first; letter case does not matter."""
    by_folded: dict[str, str] = {}
    for candidate in names:
        by_folded.setdefault(str(candidate).casefold(), str(candidate))
    close = difflib.get_close_matches(str(name).casefold(), by_folded, n=count, cutoff=0.5)
    return [by_folded[folded] for folded in close]


class SolferError(Exception):
    """Root of all errors that solfer reports.

    Attributes:
        what: The fault in one sentence, without a full stop.
        where: Place of the fault: file:line:column, element, joint and writer; empty if there is none.
        expected: What would have been right; empty if `what` says it.
        names: Nearest valid names, best first.
    """

    exit_code = 2

    def __init__(self, what: str, *, where: str = "", expected: str = "", names: Sequence[str] = ()):
        self.what, self.where, self.expected, self.names = what, where, expected, tuple(names)
        super().__init__(what)

    def at(self, where: str) -> "SolferError":
        """The error itself; its place becomes `where` if it had none."""
        self.where = self.where or where
        return self

    @property
    def line(self) -> str:
        """What is wrong and what would have been right, in one line without the place."""
        if self.names:
            return f"{self.what} (did you mean {', '.join(self.names)}?)"
        return f"{self.what} (expected: {self.expected})" if self.expected else self.what

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}" if self.where else self.what
        if self.expected:
            text += f"\n  expected: {self.expected}"
        if self.names:
            text += f"\n  did you mean: {', '.join(self.names)}?"
        return text


class UnknownName(SolferError, LookupError):
    """A name that nothing has: a plugin, joint, link, group, state, map, pipe or parameter.

    Attributes:
        kind: What was looked for, such as 'joint'.
        name: The name that was given.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str], *, where: str = "", expected: str = ""):
        known = [str(item) for item in known]
        close = nearest(name, known)
        if not close and not expected:
            shown = ", ".join(known[:12]) + (f" and {len(known) - 12} more" if len(known) > 12 else "")
            expected = f"one of {shown}" if known else f"there is no {kind} here at all"
        super().__init__(f"unknown {kind} '{name}'", where=where, expected=expected, names=close)
        self.kind, self.name = kind, name


class ConfigError(SolferError):
    """A value of a configuration that contradicts its grammar."""


class ModelError(SolferError):
    """A robot description that cannot be used: URDF, SRDF, actuators, contacts."""


class SizeMismatch(SolferError, ValueError):
    """Two sizes that have to be equal and are not; `what` names both."""


class NotFinite(SolferError, ValueError):
    """A NaN or an infinity where a number is needed."""


class PointError(SolferError):
    """Points that do not go together, or a Handler that is changed while it runs."""


class TaskError(SolferError):
    """A task that cannot be carried out, or tasks that do not go together; `where` names the task."""


class PipeError(SolferError):
    """A pipe that cannot be made, or a message that does not fit it."""


class ComponentError(SolferError):
    """A component that cannot be loaded, or a request that it refuses."""


class CommandRefused(SolferError):
    """A command that the lower level does not carry out; nothing of it was applied."""


class ClaimRefused(CommandRefused):
    """Joints that somebody else commands; names both."""


class Suspended(CommandRefused):
    """Commands that are not taken at present: an emergency stop, a controller that is stopped, a claim that is void."""


class MiddlewareError(SolferError):
    """The middleware does not answer, or refuses."""


class NotOffered(MiddlewareError):
    """A service that nobody offers."""


class NotHeard(MiddlewareError):
    """Somebody who is needed has not said a word."""


class SimulationError(SolferError):
    """A world or a simulated body that cannot be made."""


class MissingDependency(SolferError, ImportError):
    """A package that is needed and not installed; `expected` says how to install it."""


class SolferErrors(SolferError):
    """Several errors of one input, reported at once.

    Attributes:
        errors: The single errors in the order of their places.
    """

    def __init__(self, errors: Sequence[SolferError]):
        self.errors = tuple(errors)
        super().__init__("\n".join(str(error) for error in self.errors))


def raise_all(errors: Sequence[SolferError]) -> None:
    """Raise what was collected: nothing, the single error itself, or all in one `SolferErrors`."""
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise SolferErrors(errors)
