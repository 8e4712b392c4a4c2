"""Pictures of plugins in the pages: each is there, and the command beside it draws one."""

import re
import shlex

import pytest

from solfer_tools.cli.main import main

PICTURE = re.compile(r"^solfer graph (.* -o (\S+\.png))$", re.MULTILINE)


def commands(repository):
    """Return the arguments of all commands in pages that draw a picture, and the name of the picture."""
    found = [PICTURE.findall(page.read_text()) for page in sorted((repository / "docs").rglob("*.md"))]
    return [each for page in found for each in page]


def test_pictures_of_commands_are_there(repository):
    names = [name for _, name in commands(repository)]
    assert {"inverse_kinematics.png", "figure_3.png", "figure_4.png"} <= set(names)
    assert all((repository / "docs/pictures" / name).read_bytes().startswith(b"\x89PNG") for name in names)


@pytest.mark.parametrize("picture", ["inverse_kinematics.png", "figure_3.png"])
def test_a_command_draws_its_picture(repository, tmp_path, monkeypatch, picture):
    (words,) = {words for words, name in commands(repository) if name == picture}
    monkeypatch.chdir(repository)
    file = tmp_path / "picture.dot"  # Graphviz is not needed for this
    assert main(["graph", *shlex.split(words)[:-1], str(file)]) == 0
    text = file.read_text()
    assert all(f'"plugin {name}"' in text for name in re.findall(r"-n (\S+)", words))
    assert "service" in text
