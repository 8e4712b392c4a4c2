"""One mistake at a time in a configuration that is correct otherwise: its place, and its message."""

import re
import shutil
from pathlib import Path

import pytest
import yaml

from solfer.config import load
from solfer.config.yaml.compose import LOADER
from solfer.errors import SolferError, SolferErrors
from solfer.plugins import check_file

DATA = Path(__file__).parents[2] / "data"
MISTAKES = [each for file in sorted((DATA / "mistakes").glob("*.yaml")) for each in yaml.load(file.read_text(), LOADER)]


@pytest.fixture
def folder(repository, tmp_path, monkeypatch):
    """Copy the configuration, and make it the working directory."""
    shutil.copytree(repository / "test/data/config", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def findings():
    """Return all that a check reports of the main file in the working directory."""
    report = check_file("main.yaml")
    return [str(each) for each in (*report.errors, *report.warnings, *report.information)]


def without_place(text):
    return re.sub(r"^\S+:\d+:\d+: ", "", text)


@pytest.fixture(scope="module")
def always(repository):
    """Return what a check reports of the correct files, without places: a class and a plugin that nobody has."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(repository / "test/data/config")
        return {without_place(text) for text in findings()}


def test_a_check_reports_what_nobody_has(always):
    unread, absent = sorted(always, key=len)
    assert unread == "mwoibn.modules.mover: no plugin is known for 'mover', so its own tags are not read"
    begin, end = absent.split("ModuleNotFoundError: No module named 'my_package'")
    assert begin == "mwoibn.modules.player.class: module 'my_package.player' cannot be imported: "
    assert end.endswith("\n  expected: a module on the Python path (is its catkin workspace sourced?)")


@pytest.mark.daily(60)
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake["instead"].strip()[:40])
def test_a_check_reports_mistakes_word_for_word(folder, always, mistake):
    file = folder / f"{mistake['file']}.yaml"
    text = file.read_text()
    assert mistake["written"] in text
    file.write_text(text.replace(mistake["written"], mistake["instead"], 1))
    assert [text for text in findings() if without_place(text) not in always] == mistake["findings"]


@pytest.mark.needs("ros")
def test_an_unknown_package_is_placed(folder):
    file = folder / "main.yaml"
    file.write_text(file.read_text().replace("path: ., file", "path: package://no_such_pkg_at_all, file"))
    assert any(text.startswith("main.yaml:64:30: ") and "unknown package" in text for text in findings())


def test_several_mistakes_are_reported_at_once(folder):
    """Seven mistakes over four files: a user sees them all in one run, ordered, each with its file and line."""
    for name, right, wrong in [
        ("main", "function: state", "function: stat"),
        ("main", "kinematics: false", "kinematics: no"),
        ("main", "sink: /command", "snik: /command"),
        ("main", "srdf: {file: robi.srdf}", "srdf: {file: rob.srdf}"),
        ("layer", "rate: 200", "rate: -1"),
        ("secondary", "mode: idle", "layer: RT"),
        ("system", "speed: 1", "speed: 1, speed: 2"),
    ]:
        file = folder / f"{name}.yaml"
        file.write_text(file.read_text().replace(right, wrong, 1))
    with pytest.raises(SolferErrors) as caught:
        load("main.yaml", "mover")
    places = [":".join(error.where.split(":")[:2]) for error in caught.value.errors]
    assert places == [
        "main.yaml:27", "main.yaml:44", "main.yaml:53", "main.yaml:61", "system.yaml:4", "layer.yaml:2",
        "secondary.yaml:3",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (b"", "1:1", "the file is empty"),
        (b"# nothing\n", "1:1", "the file is empty"),
        (b"\x7fELF\x02\x01\x00\xf0", "1:8", "not a text in UTF-8"),
        (b"a\x00b", "1:1", "characters that YAML forbids"),
        (b"- a\n", "1:1", "there is no 'mwoibn' here"),
        (b"mwoibn: {robot: {rate: 200}", "2:1", "not YAML"),
        (b"mwoibn:\n  robot: {rate: 200}\n  robot: {rate: 100}\n", "3:3", "the key 'robot' stands twice"),
        (b"mwoibn: 200\n", "1:9", "200 cannot replace a map"),
    ],
)
@pytest.mark.parametrize("name", ["layer", "secondary", "system"])
def test_files_that_hold_something_else(folder, name, content, place, words):
    (folder / f"{name}.yaml").write_bytes(content)
    messages = [str(error) for error in check_file("main.yaml").errors]
    assert any(message.startswith(f"{name}.yaml:{place}:") and words in message for message in messages), messages


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mwoibn:\n", "there are no modules here"),
        ("mwoibn: 3\n", "there are no modules here"),
        ("mwoibn: {modules: [a]}\n", "there are no modules here"),
        ("mwoibn: {modules: {a: }}\n", "unknown module 'mover'"),
        ("mwoibn: {modules: {mover: }}\n", "the module 'mover' is empty"),
        ("mwoibn: {modules: {mover: 3}}\n", "expected a map of keys, got 3"),
        ("mwoibn: {modules: {mover: {plugins: [a]}}}\n", "'mover' lists plugins"),
        ("mwoibn: {modules: {mover: {}}, robot: {}}\n", "the key 'layer' is missing"),
    ],
)
def test_main_files_that_are_hardly_there(folder, text, words):
    (folder / "main.yaml").write_text(text)
    with pytest.raises(SolferError, match=words):
        load("main.yaml", "mover")
