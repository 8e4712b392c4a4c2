"""A catkin package with one component, from the templates beside this file."""

import importlib.util
import keyword
import re
import sys
from importlib.resources import files
from pathlib import Path

from solfer.errors import ConfigError, SolferError

TEMPLATES = {
    "package.xml": "package.xml",
    "CMakeLists.txt": "CMakeLists.txt",
    "setup.py": "setup.py",
    "pytest.ini": "pytest.ini",
    "src/@PACKAGE@/__init__.py": "init.py",
    "src/@PACKAGE@/@NAME@.py": "component.py",
    "config/@NAME@.yaml": "configuration.yaml",
    "config/@NAME@_rt.yaml": "rt.yaml",
    "launch/@NAME@.launch": "component.launch",
    "test/test_@NAME@.py": "test_component.py",
}
"""Template of each file, without its ending `.in`; words like @NAME@ are replaced in both."""

NAME = re.compile(r"[a-z][a-z0-9_]*")
ANOTHER = "another name, or --package DIR"


class Skeleton:
    """The package of a new component.

    Args:
        name: Name of the component; of its module, its configuration and its class, too.
        folder: The package's folder; its last part is the package's name.

    Attributes:
        package: Name of the package.
        target: The component's `class:` in a configuration.

    Raises:
        ConfigError: A name cannot be used, or the folder exists.
    """

    def __init__(self, name: str, folder: Path):
        self.folder, self.package = folder, folder.resolve().name
        _check(name, "component")
        _check(self.package, "package")
        if folder.exists() or folder.is_symlink():
            raise ConfigError("this exists already", where=str(folder), expected=ANOTHER)
        if self.package in sys.stdlib_module_names or importlib.util.find_spec(self.package) is not None:
            raise ConfigError(f"there is a Python module '{self.package}' already", expected=ANOTHER)
        class_name = "".join(part.capitalize() for part in name.split("_"))
        self.target = f"{self.package}.{name}:{class_name}"
        self._words = {"@NAME@": name, "@CLASS@": class_name, "@PACKAGE@": self.package}

    def write(self) -> None:
        """Make the folder and all files.

        Raises:
            SolferError: The files cannot be written.
        """
        templates = files("solfer.cli") / "templates"
        try:
            for target, template in TEMPLATES.items():
                path = self.folder / self._filled(target)
                path.parent.mkdir(parents=True, exist_ok=True)
                text = (templates / f"{template}.in").read_text(encoding="utf-8")
                path.write_text(self._filled(text), encoding="utf-8")
        except OSError as error:
            what = f"the package cannot be written: {error.strerror}"
            raise SolferError(
                what, where=str(error.filename or self.folder), expected="a folder that you may write to"
            ) from error

    def _filled(self, text: str) -> str:
        for word, value in self._words.items():
            text = text.replace(word, value)
        return text


def _check(name: str, kind: str) -> None:
    if NAME.fullmatch(name) is None or keyword.iskeyword(name):
        expected = "a small letter, then small letters, digits and underscores, and not a keyword of Python"
        raise ConfigError(f"'{name}' cannot be the name of a {kind}", expected=expected)
