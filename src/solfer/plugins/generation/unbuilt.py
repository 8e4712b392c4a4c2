"""Packages that are not built or sourced yet: they are looked for beside the configuration that names them."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def importable_beside(file: str) -> Iterator[None]:
    """Make the Python packages beside a configuration importable, after all others on the path.

    A catkin package has its configuration in `<package>/config` and its code in `<package>/src/<package>`.

    Args:
        file: The main configuration.
    """
    before = list(sys.path)
    sys.path += [os.fspath(folder) for folder in _folders(Path(file).absolute().parent) if folder.is_dir()]
    try:
        yield
    finally:
        sys.path[:] = before


def _folders(start: Path) -> Iterator[Path]:
    """Yield the folders that may hold a package: those of the file's own package first, then those beside it."""
    # a configuration's own folder, its package's, and the workspace's `src/`
    above = (start, *start.parents)[:3]
    for folder in above:
        yield from (folder / "src", folder)
    for folder in above:
        yield from sorted(package / "src" for package in folder.glob("*/") if (package / "package.xml").is_file())
