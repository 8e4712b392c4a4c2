"""One tree of errors: what is wrong, where, what was expected, and the nearest valid names.

Every mistake that a user can make ends as a `SolferError`; the nodes and the command line print it in one block and
exit with code 2. Third-party exceptions stop at the border of the room where they are raised.
"""

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

LONGEST_NAME = 200  # characters of a name that could be a typing error; a long one takes long to compare


def nearest(name: str, names: Iterable[str], count: int = 3, likeness: float = 0.5) -> list[str]:
    """Find the `count` names most like `name`, best first; letter case does not matter.

    Args:
        name: A name that may be misspelt.
        names: The names that there are.
        count: Most names that are returned.
        likeness: Least likeness of a name that is returned, of 1.
    """
    if len(str(name)) > LONGEST_NAME:
        return []
    by_folded: dict[str, str] = {}
    for candidate in names:
        by_folded.setdefault(str(candidate).casefold(), str(candidate))
    import difflib  # not needed without a mistake

    close = difflib.get_close_matches(str(name).casefold(), by_folded, n=count, cutoff=likeness)
    return [by_folded[folded] for folded in close]


class SolferError(Exception):
    """Root of all errors that solfer reports.

    Attributes:
        what: The fault in one sentence, without a full stop.
        where: Place of the fault: file:line:column, element, joint and writer; empty if there is none.
        expected: What would have been right; empty if `what` contains it.
        names: Nearest valid names, best first.
    """

    exit_code = 2

    def __init__(self, what: str, *, where: str = "", expected: str = "", names: Sequence[str] = ()):
        self.what = what
        self.where = where
        self.expected = expected
        self.names = tuple(names)
        super().__init__(what)

    def at(self, where: str) -> "SolferError":
        """Set the place to `where` if there is none, and return the error itself."""
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
    """A name that does not exist: a plugin, joint, link, group, state, map, pipe or parameter.

    Attributes:
        kind: Kind of the name, such as 'joint'.
        name: The name that was given.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str], *, where: str = "", expected: str = ""):
        known = [str(item) for item in known]
        close = nearest(name, known)
        if not close and not expected:
            shown = ", ".join(known[:12]) + (f" and {len(known) - 12} more" if len(known) > 12 else "")
            expected = f"one of {shown}" if known else f"there is no {kind} here at all"
        super().__init__(f"unknown {kind} '{name}'", where=where, expected=expected, names=close)
        self.kind = kind
        self.name = name


class ConfigError(SolferError):
    """A value of a configuration that contradicts its grammar."""


class ModelError(SolferError):
    """A robot description that cannot be used: URDF, SRDF, actuators, contacts."""


class SizeMismatch(SolferError, ValueError):
    """Two sizes that have to be equal and are not; `what` names both."""


class NotFinite(SolferError, ValueError):
    """A value is NaN or infinite."""


class PointError(SolferError):
    """Points that do not go together, or a Handler that is changed while it runs."""


class TaskError(SolferError):
    """A task that cannot be carried out, or tasks that do not go together; `where` names the task."""


class PipeError(SolferError):
    """A pipe that cannot be made, or a message that does not fit it."""


class Unrelated(PipeError):
    """A message that has nothing of what a pipe receives: it is for other pipes on its topic."""


class Contradiction(PipeError):
    """A measurement that those before it contradict: its sensor is wrong, or the robot was put into another state.

    Attributes:
        fleeting: Whether it was an impact between two messages, where the next ones agree again.
    """

    fleeting = False


class Stray(Contradiction):
    """A displacement that differs from that by the measured velocities."""

    fleeting = True


class StudyError(SolferError):
    """A study whose folder cannot be used, or whose workers cannot work."""


class OutOfLimits(SolferError):
    """A first measurement outside of a joint's limits: the plugin does not start; names joint, value and limit."""


class ComponentError(SolferError):
    """A component that cannot be loaded, or a request that it refuses."""


class Overtaken(ComponentError):
    """A request that another one has overtaken; the same one may be carried out the next time."""


class CommandRefused(SolferError):
    """A command that the lower level does not carry out; nothing of it was applied."""


class ClaimRefused(CommandRefused):
    """Joints that another plugin commands; names both."""


class Suspended(CommandRefused):
    """Commands that are refused at present: an emergency stop, a controller that is stopped, a claim that is void."""


class JointFault(SolferError):
    """A joint does not do what it is commanded to do, or is not where it is measured."""


class MiddlewareError(SolferError):
    """The middleware does not answer, or refuses."""


class ServiceUnavailable(MiddlewareError):
    """A service that no node offers."""


class ReceiveTimeout(MiddlewareError):
    """A feedback or node that is required, and from which nothing has been received."""


class RecordingError(SolferError):
    """A recording that cannot be written or read, or a channel that does not fit it."""


class SimulationError(SolferError):
    """A world or a simulated body that cannot be made."""


class MissingDependency(SolferError, ImportError):
    """A package that is needed and not installed; `expected` contains the command that installs it."""


class SolferErrors(SolferError):
    """Several errors of one input, reported at once.

    Attributes:
        errors: The single errors in the order of their places, each text once.
    """

    def __init__(self, errors: Sequence[SolferError]):
        once: dict[str, SolferError] = {}
        for error in errors:
            once.setdefault(str(error), error)
        self.errors = tuple(once.values())
        super().__init__("\n".join(str(error) for error in self.errors))


def singles(errors: Iterable[SolferError]) -> Iterator[SolferError]:
    """Yield errors one by one, those of a `SolferErrors` in its place."""
    for error in errors:
        yield from singles(error.errors) if isinstance(error, SolferErrors) else (error,)


def repeats(error: SolferError, others: Iterable[SolferError]) -> bool:
    """Return whether one of `others` is at the place of an error, and about the same names."""
    same = (other for other in others if error.where and other.where == error.where)
    return any(_quoted(error) & _quoted(other) for other in same)


def _quoted(error: SolferError) -> set[str]:
    return set(re.findall("'([^']*)'", error.what))


FRAMES = 4
"""Most places of an error in the code of others."""

_NAME_OWN = os.path.dirname(__file__) + os.sep
_LIBRARIES = ("/site-packages/", "/dist-packages/", "/lib/python3")

LONGEST_TEXT = 2000
"""Characters of a description; longer ones are cut."""


def described(error: BaseException, lines: bool = False) -> str:
    """Describe an error for an operator: ours by their text, others by the kind of the exception and its text.

    Never fails: the text of a third-party exception may be impossible to make, endless, or impossible to write
    anywhere.

    Args:
        error: The exception.
        lines: Whether to describe an error of ours with its place, on several lines; else in one line without it.
    """
    kind = type(error).__name__
    try:
        ours = isinstance(error, SolferError)
        text = error.line if isinstance(error, SolferError) and not lines else str(error)
        text = text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}..."
        text = text.encode(errors="backslashreplace").decode()
    except BaseException as another:  # whatever its kind, it does not describe the error
        return f"{kind}, whose text cannot be made: {type(another).__name__}"
    if ours:
        return text
    return f"{kind}: {text}" if text else kind


def located(error: BaseException, lines: bool = False) -> str:
    """Describe an error that the code of others raised, with the places in that code; see `described`."""
    places = ", ".join(_places(error))
    return f"{described(error, lines)} (at {places})" if places else described(error, lines)


def _places(error: BaseException) -> list[str]:
    """List where an error went through code of others, the innermost place last; reads no file.

    Places in libraries are left out. An error that is not ours and came through our code alone has its innermost place.
    """
    import traceback

    walked = [(frame.f_code, line) for frame, line in traceback.walk_tb(error.__traceback__)]
    foreign = [(code, line) for code, line in walked if not code.co_filename.startswith((_NAME_OWN, "<frozen"))]
    authors = [each for each in foreign if not any(folder in each[0].co_filename for folder in _LIBRARIES)]
    shown = (authors or foreign)[-FRAMES:] or ([] if isinstance(error, SolferError) else walked[-1:])
    return [f"{code.co_filename}:{line} in {code.co_name}" for code, line in shown]


@contextmanager
def writing(
    what: str, where: object, kind: type[SolferError] = SolferError, expected: str = "a file that you may write to"
) -> Iterator[None]:
    """Raise an error of a kind where a file or a folder cannot be written."""
    try:
        yield
    except OSError as error:
        why = error.strerror or error
        raise kind(f"{what} cannot be written: {why}", where=str(where), expected=expected) from error


def raise_all(errors: Sequence[SolferError]) -> None:
    """Raise the collected errors: nothing, the single error itself, or all in one `SolferErrors`."""
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise SolferErrors(errors)
