"""The folder of pictures: other processes may choose names in it, and nothing else."""

import os
import re
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from solfer.errors import ConfigError, SimulationError


class Pictures:
    """Where pictures are written: files with names that end in `.png`, in one folder of this user.

    Each is written beside its place and renamed, so that nothing is written through a link.

    Args:
        folder: The folder; None: `solfer/pictures` below ROS_HOME, or below `~/.ros`, which is made when it is needed.

    Raises:
        ConfigError: It is not a folder.
    """

    def __init__(self, folder: str | os.PathLike | None = None):
        if folder is not None and not os.path.isdir(folder):
            raise ConfigError(f"there is no folder '{os.fspath(folder)}' for pictures", expected="a folder")
        self._given = None if folder is None else Path(os.path.realpath(folder))

    @property
    def folder(self) -> Path:
        """The folder."""
        home = os.environ.get("ROS_HOME") or os.path.join(os.path.expanduser("~"), ".ros")
        return self._given or Path(os.path.abspath(home), "solfer", "pictures")

    def place(self, text: str) -> Path:
        """Return the path of a picture with a name from outside, with or without this folder before it.

        Raises:
            SimulationError: It does not lie in the folder, or is not a name of a picture.
        """
        folder, name = os.path.split(text)
        if folder not in ("", str(self.folder)) or not re.fullmatch(r"\w[\w. -]{0,99}\.png", name, re.ASCII):
            raise SimulationError(
                f"'{text[:200]}' cannot become a picture",
                expected="the name of a picture in the simulator's folder of pictures, such as robot.png",
            )
        return self.folder / name


def write_picture(path: Path, draw: Callable[[BinaryIO], None]) -> None:
    """Let `draw` write a file, which takes the place of what was at `path`.

    Raises:
        SimulationError: The folder is not this user's own, is full, or cannot be written.
    """
    try:
        os.makedirs(path.parent, 0o700, exist_ok=True)
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError as error:
        raise SimulationError(
            f"the folder of pictures cannot be used: {error.strerror}", expected="a folder that you may write to"
        ) from error
    try:
        _check(folder, path.name)
        _write(folder, path.name, draw)
    except OSError as error:
        raise SimulationError(
            f"the picture cannot be written: {error.strerror}", expected="a file that you may write to"
        ) from error
    finally:
        os.close(folder)


def _check(folder: int, name: str) -> None:
    status = os.fstat(folder)
    if status.st_uid != os.geteuid() or status.st_mode & 0o022:  # the group or all users may write
        raise SimulationError(
            "the folder of pictures is not the user's own",
            expected="a folder of the simulator's user, which no other user may write",
        )
    names = os.listdir(folder)
    if len(names) >= 1000 and name not in names:
        raise SimulationError("the folder of pictures is full", expected="1000 pictures at most")


def _write(folder: int, name: str, draw: Callable[[BinaryIO], None]) -> None:
    new = f".{secrets.token_hex(8)}"
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
    handle = os.open(new, flags, 0o600, dir_fd=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            draw(file)
        os.rename(new, name, src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        os.unlink(new, dir_fd=folder)
        raise
