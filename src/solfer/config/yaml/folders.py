"""Files that requests from outside of this process may name."""

import os
import re
from collections.abc import Iterable
from pathlib import Path

from solfer.config.yaml.packages import workspace_packages
from solfer.errors import ConfigError


class Folders:
    """The YAML files below some folders, and those of the packages of this workspace.

    All refusals have the same words, whether there is such a file or not. Links are followed before the
    folders are compared, so that none leads out of them. The folder that `package://NAME/FOLDER` names may be a link.

    Args:
        folders: The folders.

    Raises:
        ConfigError: One of them is not a folder.
    """

    def __init__(self, folders: Iterable[str | os.PathLike] = ()):
        self._roots: list[str] = []
        self._packages: dict[str, str] | None = None
        for folder in folders:
            self.add(folder)

    def add(self, folder: str | os.PathLike, where: str = "") -> None:
        """Allow the files below a folder.

        Raises:
            ConfigError: `folder` is not a folder; `where` is the place that named it.
        """
        if not os.path.isdir(folder):
            raise ConfigError(f"there is no folder '{os.fspath(folder)}'", where=where, expected="a folder")
        self._roots.append(os.path.realpath(folder))

    def file(self, text: str) -> Path:
        """Resolve the path of the file that `text` names, without links.

        Raises:
            ConfigError: It is not below one of the folders.
        """
        path = self._found(text)
        if path is None:
            shown = text if len(text) <= 200 else f"{text[:200]}..."
            raise ConfigError(
                f"'{shown}' is not a file that may be read",
                expected="a .yaml file below a folder that is allowed, or package://NAME/... of this workspace",
            )
        return Path(path)

    def _found(self, text: str) -> str | None:
        if len(text) > 4096 or "\0" in text or not text.endswith((".yaml", ".yml")):
            return None
        in_package = re.fullmatch(r"package://([^/]+)/+([^/]+)/+.+", text, re.DOTALL)
        if in_package is None:
            return _below(text, self._roots) if os.path.isabs(text) else None
        package = self._workspace().get(in_package[1])
        top = in_package[2]
        if package is None or top in (os.curdir, os.pardir):
            return None
        inside = text[in_package.start(2) :]
        return _below(os.path.join(package, inside), [os.path.realpath(os.path.join(package, top)), *self._roots])

    def _workspace(self) -> dict[str, str]:
        """Find the folders of the packages beside this one; they are searched for once."""
        if self._packages is None:
            self._packages = workspace_packages()
        return self._packages


def _below(path: str, roots: Iterable[str]) -> str | None:
    resolved = os.path.realpath(path)
    return resolved if any(os.path.commonpath((root, resolved)) == root for root in roots) else None
