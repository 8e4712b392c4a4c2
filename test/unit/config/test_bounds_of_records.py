"""Numbers of configurations and of command lines have bounds, and lists have no duplicates."""

import argparse
import importlib
import os
import pkgutil
import typing
from pathlib import Path

import pytest

import solfer
from solfer.cli.options import Number
from solfer.config import Record, read
from solfer.config.loading.rt_layer import read_layer
from solfer.config.records.rt_layer import ExecutorRecord
from solfer.errors import SolferError
from solfer.plugins import check_file
from solfer.realtime import schedule

CONFIG = Path(__file__).resolve().parents[3] / "config"
ROSLESS = ("solfer.middleware.ros", "solfer.middleware.bridge", "solfer.msg", "solfer.srv", "solfer_tools.demo")


def records(parent=Record):
    """Yield all records of the package."""
    for record in parent.__subclasses__():
        if record.__module__.startswith("solfer."):
            yield record
        yield from records(record)


def open_numbers(annotation, metadata=()):
    """Return whether an annotation contains a number without a smallest or a largest value."""
    if annotation in (int, float):
        names = ("ge", "gt", "le", "lt")
        bounds = {name for part in metadata for name in names if getattr(part, name, None) is not None}
        return not (bounds & {"ge", "gt"} and bounds & {"le", "lt"})
    inner = typing.get_args(annotation)
    if typing.get_origin(annotation) is typing.Annotated:
        return open_numbers(inner[0], [part for each in inner[1:] for part in getattr(each, "metadata", [each])])
    if typing.get_origin(annotation) is typing.Literal:
        return False
    union = type(None) in inner
    return any(open_numbers(part, metadata if union else ()) for part in inner)


@pytest.fixture(scope="module")
def found():
    """Return all records, of all modules that need no ROS."""
    for module in pkgutil.walk_packages(solfer.__path__, "solfer."):
        if not module.name.startswith(ROSLESS):
            importlib.import_module(module.name)
    return {*records()}


def test_every_number_of_every_record_has_bounds(found):
    assert len(found) > 50
    unbounded = [
        f"{record.__name__}.{name}"
        for record in found
        if record.__module__.startswith("solfer")
        for name, field in record.model_fields.items()
        if open_numbers(field.annotation, field.metadata)
    ]
    assert not unbounded


def is_a_vector(field):
    return any(getattr(part, "max_length", None) is not None for part in field.metadata)


def test_names_may_be_of_one_letter(found):
    shortest = {
        f"{record.__name__}.{name}": part.min_length
        for record in found
        if record.__module__.startswith("solfer")
        for name, field in record.model_fields.items()
        for part in field.metadata
        if getattr(part, "min_length", None) is not None and not is_a_vector(field)
    }
    assert len(shortest) > 20 and set(shortest.values()) == {1}


@pytest.mark.parametrize(
    ("tag", "value", "expected"),
    [
        ("rate: 1e9", "1e9", "at most 4000"),
        ("rate: 1e-3", "1e-3", "at least 1"),
        ("rate: 1e29", "1e29", "at most 4000"),
        ("rate: 1e-300", "1e-300", "at least 1"),
        ("record: 1e300", "1e300", "at most 600"),
        ("blend: 1e300", "1e300", "at most 60"),
        ("schedule: {priority: 99}", "99", "at most 90"),
        ("schedule: {cpus: [-1]}", "-1", "at least 0"),
        ("schedule: {cpus: [0, 99999]}", "99999", "at most 4095"),
        ("schedule: {timer_slack: 100000000}", "100000000", r"at most 1e\+06"),
    ],
)
def test_a_layer_beyond_limits_is_refused(tmp_path, tag, value, expected):
    file = tmp_path / "layer.yaml"
    file.write_text(f"executor:\n  {tag}\n")
    with pytest.raises(SolferError, match=rf"a number of {expected}, got") as error:
        read(file, ExecutorRecord, ("executor",))
    assert error.value.where.startswith(f"{file}:2:{3 + tag.index(value)}: executor")


@pytest.mark.parametrize("rate", ["1e9", "1e-3", "1e29", "1e-300", "0.5", "4001"])
def test_a_plugin_rate_beyond_limits_is_refused(repository, tmp_path, rate):
    for file in (repository / "test/data/config").iterdir():
        if file.is_file():
            (tmp_path / file.name).write_text(file.read_text().replace("rate: 200", f"rate: {rate}"))
    messages = [str(error) for error in check_file(tmp_path / "main.yaml").errors]
    assert any("layer.yaml:2:17: mwoibn.robot.rate: expected a number of at" in text for text in messages), messages


@pytest.mark.parametrize(
    ("plugins", "column"),
    [
        ("joint_states, joint_states", 41),
        ("joint_states, joint_states::joint_states", 41),
        ("a::joint_lower, b::joint_lower", 43),
    ],
)
def test_a_plugin_listed_again_gets_another_name(tmp_path, plugins, column):
    file = tmp_path / "layer.yaml"
    file.write_text(f"XBotRTPlugins: {{plugins: [{plugins}]}}\nmwoibn: {{config_file: {CONFIG / 'centauro.yaml'}}}\n")
    layer = read_layer(file)
    first, second = layer.load()
    assert (first.name, second.name) == (first.configuration.name, f"{first.configuration.name}_2")
    assert [each.configuration.module.name for each in (first, second)] == [first.name, second.name]
    (notice,) = layer.problems.notices
    assert str(notice.mark).startswith(f"{file}:1:{column}") and f"named '{second.name}'" in notice.what


def test_missing_processors_are_refused_without_harm():
    before = os.sched_getaffinity(0)
    absent = max(before) + 1
    wishes = schedule.ScheduleRequest(0, (min(before), absent), False, 0, False, False)
    granted = schedule.apply(wishes)
    assert granted.refused and f"no processor {absent} for this process" in granted.text
    assert os.sched_getaffinity(0) == before
    granted.close()


@pytest.mark.parametrize("text", ["nan", "inf", "-1", "1e300", "1e-300", "x", "", "0"])
def test_command_line_numbers_beyond_limits_are_refused(text):
    parser = argparse.ArgumentParser(exit_on_error=False)
    parser.add_argument("--limit", type=Number(0.01, 60.0, "s"))
    with pytest.raises(argparse.ArgumentError, match=r"expected a number from 0.01 to 60 \[s\]"):
        parser.parse_args([f"--limit={text}"])
    assert parser.parse_args(["--limit", "0.5"]).limit == 0.5 and Number(1e-3, 1e3, "s", zero=True)("0") == 0.0
