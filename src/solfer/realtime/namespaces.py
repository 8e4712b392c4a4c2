"""Looks up namespaces of this machine by name."""

from pathlib import Path

from solfer.errors import MiddlewareError, UnknownName, nearest
from solfer.segments.files import PREFIX
from solfer.segments.namespace import SHARED_MEMORY, Namespace, names
from solfer.segments.segment import Segment
from solfer.telemetry import STATISTICS


def find(name: str, root: Path = SHARED_MEMORY) -> Namespace:
    """Open an existing namespace; makes none.

    Raises:
        UnknownName: It does not exist; suggests the nearest names, and those in which an RT layer runs.
        MiddlewareError: The name is wrong, or the folder is a link, or belongs to another user.
    """
    try:
        return Namespace(name, root, make=False)
    except UnknownName as error:
        raise UnknownName("namespace", name, names(root), where=str(root), expected=cure(root)) from error


def no_layer(namespace: Namespace) -> MiddlewareError:
    """Make the error that no RT layer runs in a namespace; it suggests those in which one does."""
    root = namespace.folder.parent
    return MiddlewareError(
        f"no RT layer lives in the namespace '{namespace.name}'",
        where=str(namespace.folder),
        expected=cure(root),
        names=nearest(namespace.name, living(root)),
    )


def layer_of(folder: Path) -> Segment | None:
    """Return the segment of the RT layer that lives in the folder of a namespace; None if there is none."""
    try:
        segment = Segment.attach(folder / STATISTICS, STATISTICS)
    except MiddlewareError:
        return None
    return segment if segment.owned() else None


def living(root: Path = SHARED_MEMORY) -> list[str]:
    """List the namespaces in which an RT layer runs, of those that this process may read."""
    return [name for name in names(root) if layer_of(root / f"{PREFIX}{name}") is not None]


def cure(root: Path) -> str:
    """Describe the expected name of a namespace, for errors."""
    layers = living(root)
    return f"--namespace of an RT layer that lives: {', '.join(layers)}" if layers else "an RT layer that lives"
