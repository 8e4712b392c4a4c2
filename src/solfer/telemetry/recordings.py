"""Finds what is recorded on this machine."""

import contextlib
import logging
import os
import shutil
import stat
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import urlsplit

from solfer.errors import MiddlewareError, RecordingError, UnknownName
from solfer.segments.files import PREFIX
from solfer.segments.lock import locked
from solfer.segments.namespace import SHARED_MEMORY, Namespace, names
from solfer.telemetry.drain import RecordDrain
from solfer.telemetry.rows import RECORDING

logger = logging.getLogger(__name__)

SHARED_FOLDER = "recordings"
"""Folder of a namespace for processes that have no namespace of their own, such as the nodes of a ROS master."""


MASTER_PREFIX = "ros."
"""How the names of namespaces begin in which nodes of a ROS master are recorded."""

RUNNING = "a plugin that runs, such as by `./run demo` or `roslaunch solfer joint_states.launch`; or --wait SECONDS"
"""What can be recorded, for errors where nothing runs."""

YOUNG_AGE = 60.0
"""Age up to which such a namespace is kept without a living process [s]: one may be about to begin."""

BEGINNING = 1.0
"""The same where the last node of this user ends [s]: another one has then made its own folder, but no recording."""

CRASH_AGE = 86400.0
"""Age up to which it is kept without a living process for what a crash left in it [s]."""


def namespace_of_master() -> str:
    """Return the namespace for recordings of this user's nodes of this ROS master, and of this namespace of ROS."""
    port = urlsplit(os.environ.get("ROS_MASTER_URI", "")).port or 11311
    inside = os.environ.get("ROS_NAMESPACE", "")
    return ".".join((f"{MASTER_PREFIX}{os.geteuid()}.{port}", *filter(None, inside.split("/"))))


def place_beside(namespace: str, node: str) -> Path:
    """Return the folder for the recording of a node in a namespace, after making it; sweep the others before.

    Raises:
        MiddlewareError: It cannot be made.
    """
    sweep(namespace)
    return Namespace(namespace).place(SHARED_FOLDER, node, RECORDING).parent


def sweep(own: str, root: Path = SHARED_MEMORY) -> None:
    """Remove what nodes of other ROS masters have left, of this user, where none of them lives any more."""
    for name in names(root):
        folder = root / f"{PREFIX}{name}"
        if name != own and name.startswith(MASTER_PREFIX):
            with contextlib.suppress(OSError):
                if _age(folder) >= YOUNG_AGE and _is_left(folder):
                    shutil.rmtree(folder)


def leave(namespace: str, root: Path = SHARED_MEMORY) -> None:
    """Remove a namespace of a ROS master after the orderly end of its last node."""
    folder = root / f"{PREFIX}{namespace}"
    with contextlib.suppress(OSError):
        if _age(folder / SHARED_FOLDER) >= BEGINNING and _is_left(folder):
            shutil.rmtree(folder)


def _is_left(folder: Path) -> bool:
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
        return False
    files = [each for each in folder.rglob("*") if each.is_file()]
    lives = any(locked(each.with_suffix("")) for each in files if each.suffix == ".lock")
    return not lives and all(_age(each) > CRASH_AGE for each in files if each.name == RECORDING)


def _age(path: Path) -> float:
    return time.time() - path.lstat().st_mtime


def recordings(root: Path = SHARED_MEMORY) -> Iterator[tuple[str, RecordDrain]]:
    """Yield the recordings of processes that live and that this one may read, each with the name of its namespace."""
    for name in names(root):
        folder = root / f"{PREFIX}{name}"
        with contextlib.suppress(PermissionError):  # another user's
            for each in (folder, *sorted((folder / SHARED_FOLDER).glob("*/"))):
                with contextlib.suppress(MiddlewareError):  # nothing is recorded there
                    drain = RecordDrain(each)
                    if not drain.over:
                        yield name, drain


def keep(folder: Path, node: str) -> None:
    """Copy the memory of a node into the folder `SOLFER_RECORDINGS`, if that is set; if it is not possible, warn of it.

    Args:
        folder: Folder of the memory.
        node: Name of the node.
    """
    kept = os.environ.get("SOLFER_RECORDINGS")
    if not kept:
        return
    target = Path(kept, node.strip("/"))
    try:
        target.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / RECORDING, target / RECORDING)
    except OSError as error:
        logger.warning("the last cycles are not kept in %s: %s", target, error.strerror)


class FileRecorder:
    """A process of its own that writes what a loop records to a file, until the loop has ended, however it ends.

    Args:
        namespace: Namespace of the loop.
        plugins: Its plugins.
        file: The file.
        timeout: Longest wait for plugins that are not there yet [s].

    Attributes:
        process: The process.

    Raises:
        RecordingError: Nothing can be written there.
    """

    PROGRAM = "import sys; from solfer.cli.main import main; sys.exit(main())"
    """What the process runs."""

    TIMEOUT = 10.0
    """Longest time that the end waits for a complete file [s]."""

    def __init__(self, namespace: str, plugins: Sequence[str], file: Path, timeout: float = 0.0):
        if not os.access(file.absolute().parent, os.W_OK):
            raise RecordingError(
                "no file can be made there", where=str(file), expected="a folder that exists, and that you may write to"
            )
        names = [word for plugin in plugins for word in ("-n", plugin)]
        command = ["record", *names, "--whole", "--wait", str(timeout), namespace, str(file.absolute())]
        # a session of its own: Ctrl-C ends the loop first, and then this has all of it
        self.process = subprocess.Popen(
            [sys.executable, "-c", self.PROGRAM, *command], stdin=subprocess.DEVNULL, start_new_session=True
        )

    def close(self) -> None:
        """Wait until the file is complete; the loop has ended."""
        try:
            self.process.wait(self.TIMEOUT)
        except subprocess.TimeoutExpired:
            logger.warning("the recording ends before the loop, which goes on after %g s", self.TIMEOUT)
            self.process.terminate()  # a SIGINT would be lost while Python still begins


def of_plugins(plugins: Sequence[str], namespace: str = "", root: Path = SHARED_MEMORY) -> list[RecordDrain]:
    """Return the recordings of plugins by name: of each process, in a namespace or any, its part of them.

    Raises:
        UnknownName: A plugin is not recorded.
        MiddlewareError: Several processes record a plugin of this name.
    """
    found = [drain for name, drain in recordings(root) if name == (namespace or name)]
    for plugin in plugins:
        count = sum(plugin in drain.plugins for drain in found)
        if not count:
            known = {name for drain in found for name in drain.plugins}
            expected = "" if known else RUNNING
            raise UnknownName("plugin", plugin, sorted(known), where="what is recorded now", expected=expected)
        if count > 1:
            raise MiddlewareError(
                f"{count} processes record a plugin '{plugin}'", expected="NAMESPACE of the one that is meant"
            )
    return [drain.only(plugins) for drain in found if set(plugins) & set(drain.plugins)]


def of_namespace(namespace: str, root: Path = SHARED_MEMORY) -> list[RecordDrain]:
    """Return all recordings of a namespace; where none is named, of the only one that records.

    Raises:
        UnknownName: Nothing is recorded there.
        MiddlewareError: None is named, and several record.
    """
    found = list(recordings(root))
    known = sorted({name for name, _ in found})
    if not namespace and len(known) > 1:
        raise MiddlewareError(f"{len(known)} namespaces record", expected=f"NAMESPACE, one of {', '.join(known)}")
    chosen = namespace or (known[0] if known else "solfer")
    if chosen not in known:
        expected = "" if known else RUNNING
        raise UnknownName("namespace that records", chosen, known, where=str(root), expected=expected)
    return [drain for name, drain in found if name == chosen]
