"""A catkin package that is written from templates."""

import json
import keyword
import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from solfer.errors import ConfigError, SolferError

ANOTHER = "another name, or --package DIR"


class Skeleton:
    """A package of which nothing is there yet.

    Args:
        kind: What the package is made for; the name of its folder of templates.
        name: Name of it.
        folder: The package's folder; its last part is the package's name.

    Attributes:
        package: Name of the package.

    Raises:
        ConfigError: A name cannot be used, or the folder exists.
    """

    def __init__(self, kind: str, name: str, folder: Path):
        self.folder, self.package = folder, folder.resolve().name
        self._templates = files("solfer_tools.cli") / "templates" / kind
        _check(name, kind)
        _check(self.package, "package")
        if folder.exists() or folder.is_symlink():
            raise ConfigError("this exists already", where=str(folder), expected=ANOTHER)

    def fill(
        self, templates: Mapping[str, str], words: Mapping[str, str], made: Mapping[Path, bytes] = MappingProxyType({})
    ) -> None:
        """Make the folder and all files.

        Args:
            templates: Template of each file, without its ending `.in`.
            words: What words like @NAME@ are replaced by, in the files and their names.
            made: Contents of further files by path.

        Raises:
            SolferError: The files cannot be written.
        """
        try:
            for target, template in templates.items():
                path = self.folder / _filled(target, words)
                path.parent.mkdir(parents=True, exist_ok=True)
                text = (self._templates / f"{template}.in").read_text(encoding="utf-8")
                path.write_text(_filled(text, words), encoding="utf-8")
            for path, content in made.items():
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        except OSError as error:
            what = f"the package cannot be written: {error.strerror}"
            where = str(error.filename or self.folder)
            raise SolferError(what, where=where, expected="a folder that you may write to") from error


def scalar(text: str) -> str:
    """Write a text that may hold anything, such as the name of a link, as a scalar of YAML."""
    words = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")  # no strings in YAML
    if re.fullmatch(r"[A-Za-z][A-Za-z0-9_./-]*", text) and text.lower() not in words:
        return text
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(each if each.isprintable() else f"\\U{ord(each):08x}" for each in quoted)


def _filled(text: str, words: Mapping[str, str]) -> str:
    """Replace words at once: a name may look like one of them."""
    return re.sub("|".join(map(re.escape, words)), lambda found: words[found[0]], text)


def _check(name: str, kind: str) -> None:
    if re.fullmatch(r"[a-z][a-z0-9_]*", name) is None or keyword.iskeyword(name):
        expected = "a small letter, then small letters, digits and underscores, and not a keyword of Python"
        raise ConfigError(f"'{name}' cannot be the name of a {kind}", expected=expected)
