"""`solfer params` beside a plugin whose services are in shared memory."""

import shutil
import threading
import uuid
from contextlib import contextmanager

import pytest
from support.plugins.fleet import Fleet, loaded, still
from support.recording.sine import tree

from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.plugins.generation.config_service import answer_at_once
from solfer.segments.namespace import Namespace
from solfer_tools.cli.completion import finder
from solfer_tools.cli.main import main, parser

TAGS = {"gain": 0.3, "limit": 4.0, "parts": {"hand": {"weight": 2.0}, "foot": {}}}
LAYER = f"test-{uuid.uuid4().hex}"


@contextmanager
def served(plugin, cycle):
    """Serve the parameters of a plugin in shared memory, in a loop of its own."""
    node, over = XbotMiddleware(LAYER, "server"), threading.Event()
    tuning = plugin.tuning
    node.serve("first", [tuning.setting()], plugin.inbox.submit_one_by_one)
    node.serve("first", [tuning.getting()], answer_at_once)

    def loop():
        while not over.wait(0.0005):
            node.poll()
            cycle()

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        node.close()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Let a plugin with live parameters run in a loop of its own."""
    changed = tree("support.plugins.tuned:Tuned")
    changed["modules"]["first"] |= TAGS
    fleet = Fleet(tmp_path_factory.mktemp("fleet"), changed, ("first",), together=False)
    try:
        with served(fleet.plugins[0], lambda: fleet.cycle(**still())):
            yield fleet
    finally:
        shutil.rmtree(Namespace(LAYER).folder)


@pytest.fixture
def component(fleet):
    """Return the component, with the parameters of its configuration."""
    yield fleet.plugins[0].component
    params("set", "first", "gain=0.3", "limit=4", "parts.hand.weight=2", "least=0", "law=sine")


def params(*words):
    """Run `solfer params`, and return its exit code."""
    return main(["params", "--namespace", LAYER, *words])


def refused(capsys, *words):
    """Run what is refused, and return its one error."""
    assert params(*words) == 2
    out, error = capsys.readouterr()
    assert out == "" and error.count("error: ") == 1 and "Traceback" not in error
    return error


def test_list_prints_a_table(component, capsys):
    assert params("list", "first") == params("list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[: len(lines) // 2] == lines[len(lines) // 2 :] and lines[0] == "first"
    rows = {line.split()[0]: line.split()[1:] for line in lines[1:]}
    assert rows["name"] == ["value", "unit", "range", "default", "description"]
    assert " ".join(rows["gain"]) == "0.3 1/s number, above 0 to 2 0.3 gain of what joints miss [1/s]"
    assert rows["parts.hand.weight"][:7] == ["2", "Nm", "number", "or", "list,", "0", "to"]


def test_get_prints_what_set_takes(component, capsys):
    assert params("set", "/first", "gain=0.7", "law=line", "parts.hand.weight=[1, 2.5]") == 0
    assert component.tags.gain == 0.7 and component.tags.law == "line"
    assert params("get", "first", "gain", "law", "parts.hand.weight") == 0
    assert capsys.readouterr().out.splitlines() == ["gain=0.7", "law=line", "parts.hand.weight=[1.0, 2.5]"]
    assert params("set", "first", "gain=") == 0 and component.tags.gain == 0.3


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (("set", "frist", "gain=1"), ("unknown plugin 'frist'", "did you mean: first")),
        (("get", "frist", "gain"), ("did you mean: first",)),
        (("set", "first", "gain=2.5"), ("gain: expected a number of at most 2, got 2.5", "above 0 to 2 [1/s]")),
        (("set", "first", "gain=fast"), ("gain: expected a number, got 'fast'",)),
        (("set", "first", "gian=1"), ("unknown parameter 'gian'", "did you mean: gain")),
        (("get", "first", "gian"), ("unknown parameter 'gian'", "did you mean: gain")),
        (("set", "first", "gain=1", "law=circle"), ("law: expected 'sine' or 'line'",)),
        (("set", "first", "gain=1", "gain=2"), ("'gain' is given twice",)),
        (("set", "first", "gain"), ("'gain' has no value", "NAME=VALUE")),
        (("set", "first", "least=6"), ("'least' is above 'most'",)),
    ],
)
def test_what_is_wrong_is_one_error_and_changes_nothing(component, capsys, words, texts):
    before = component.tags
    error = refused(capsys, *words)
    assert all(text in error for text in texts), error
    assert component.tags is before


def test_a_namespace_that_is_not_there_is_named(component, capsys):
    assert main(["params", "list", "--namespace", f"{LAYER}x"]) == 2
    assert f"did you mean: {LAYER}" in capsys.readouterr().err


def test_what_differs_is_saved_and_loads(fleet, component, tmp_path, capsys):
    """A new file, laid over the configuration, leads to the tags that the plugin has."""
    assert params("set", "first", "gain=0.7", "parts.hand.weight=[1, 2.5]", "law=line") == 0
    file = tmp_path / "over.yaml"
    assert params("save", "first", str(file)) == 0
    assert capsys.readouterr().out == f"{file}: 3 values of first written\n"
    changed = tree("support.plugins.tuned:Tuned")
    changed["modules"]["first"] |= TAGS | {"secondary_file": {"file": "over.yaml", "path": str(tmp_path)}}
    (configuration,) = loaded(tmp_path, changed, ("first",))
    assert configuration.tags(type(component).Tags) == component.tags


def test_a_file_that_is_there_keeps_its_comments_and_order(component, tmp_path):
    file = tmp_path / "over.yaml"
    file.write_text(
        "# mine\nmwoibn:\n  modules:\n    first:\n      parts:  # hands\n        hand: {weight: 2.0}  # both\n"
        "      gain: 0.3 # slow\n      # the end\n"
    )
    assert params("set", "first", "gain=0.7", "parts.hand.weight=3", "law=line") == 0
    assert params("save", "first", str(file)) == params("save", "first", str(file)) == 0
    assert file.read_text() == (
        "# mine\nmwoibn:\n  modules:\n    first:\n      parts:  # hands\n        hand: {weight: 3}  # both\n"
        "      gain: 0.7 # slow\n      law: line\n      # the end\n"
    )


@pytest.mark.parametrize(
    ("text", "change", "error"),
    [
        ("mwoibn: [1\n", "gain=0.7", "not YAML"),
        ("a: &a {gain: 0.3}\nmwoibn: {modules: {first: *a, second: *a}}\n", "gain=0.7", "gain' cannot be written here"),
        ("mwoibn: {modules: 3}\n", "gain=0.7", "cannot be written here"),
        ("", "limit=", "'limit' is left out, and was 4"),
    ],
)
def test_a_file_that_cannot_take_a_value_stays(component, tmp_path, capsys, text, change, error):
    file = tmp_path / "over.yaml"
    file.write_text(text)
    assert params("set", "first", change) == 0
    assert error in refused(capsys, "save", "first", str(file))
    assert file.read_text() == text
    assert "cannot be written" in refused(capsys, "save", "first", str(tmp_path / "no" / "file.yaml")) or not text


def test_words_are_completed(component):
    for line, offered in (
        (f"params set --namespace {LAYER} ", "first"),
        (f"params get --namespace {LAYER} first ga", "gain"),
        ("params ", "list"),
    ):
        *before, word = line.split(" ")
        found = finder(parser())._get_completions(["solfer", *before], word, "", None)
        assert offered in [each.rstrip() for each in found]


def test_a_plugin_that_is_gone_is_no_plugin(component, capsys, tmp_path):
    changed = tree("support.plugins.tuned:Tuned")
    other = f"{LAYER}-other"
    node = XbotMiddleware(other, "server")
    try:
        (plugin,) = Fleet(tmp_path, changed, ("first",), together=False).plugins
        node.serve("first", [plugin.tuning.getting()], answer_at_once)
        node.close()
        assert main(["params", "list", "first", "--namespace", other]) == 2
        assert "unknown plugin 'first'" in capsys.readouterr().err
    finally:
        shutil.rmtree(Namespace(other).folder)
