"""Pictures by Graphviz."""

import shutil
import subprocess
from pathlib import Path

from solfer.errors import ConfigError, MissingDependency, SolferError, writing


def draw(dot: str, path: Path) -> None:
    """Write a picture in the format that the ending of `path` names.

    Args:
        dot: Text in the DOT language.
        path: The picture: `.svg`, `.png`, or `.dot` for the text itself.

    Raises:
        ConfigError: `path` has another ending.
        MissingDependency: Graphviz is not installed.
        SolferError: Graphviz fails, or the file cannot be written.
    """
    form = path.suffix.lstrip(".").lower()
    formats = ("svg", "png", "dot")
    if form not in formats:
        endings = ", ".join(f".{each}" for each in formats)
        raise ConfigError(f"'{path}' is not a picture that can be drawn", expected=f"a file with the ending {endings}")
    content = dot.encode() if form == "dot" else _rendered(dot, form)
    with writing("the picture", path):
        path.write_bytes(content)


def _rendered(dot: str, form: str) -> bytes:
    program = shutil.which("dot")
    if program is None:
        raise MissingDependency(
            f"a {form} is drawn by Graphviz, which is not installed",
            expected="apt install graphviz; or without it: --text, or -o FILE.dot",
        )
    resolution = ["-Gdpi=110"] if form == "png" else []
    try:
        done = subprocess.run(
            [program, f"-T{form}", *resolution],
            input=dot.encode(),
            capture_output=True,
            timeout=60.0,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SolferError(
            f"Graphviz does not draw: {error}", where=program, expected="Graphviz (apt install graphviz), or --text"
        ) from error
    if done.returncode:
        raise SolferError(
            f"Graphviz fails: {done.stderr.decode(errors='replace').strip()}",
            where=program,
            expected="a version of Graphviz that draws; --text needs none",
        )
    return done.stdout
