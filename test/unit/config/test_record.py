"""Records: strict values, and errors in our own words."""

import logging
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import pytest
from pydantic import Field

from solfer.config import Record, TextRecord, read
from solfer.errors import ConfigError, SolferErrors, UnknownName


class Spring(Record):
    """A spring."""

    stiffness: float = Field(gt=0, description="stiffness [Nm/rad]")
    kind: Literal["SEA", "PEA"] = Field(default="SEA", description="kind")
    stages: int = Field(default=1, description="stages")


class SpringArm(Record):
    """An arm with springs."""

    name: str = Field(description="name of the arm")
    active: bool = Field(default=True, description="whether it is active")
    springs: dict[str, Spring] = Field(default_factory=dict, description="springs by joint")
    gains: float | tuple[float, ...] = Field(default=1.0, description="one gain or one each")
    offset: tuple[float, float, float] = Field(default=(0.0, 0.0, 0.0), description="offset [m]")
    list_of: list[str] = Field(default_factory=list, description="names")
    tools: frozenset[str] = Field(default=frozenset(), description="what it can hold")
    old: int | None = Field(default=None, deprecated="nothing uses it", description="obsolete")

    replaced: ClassVar[Mapping[str, str]] = {"reach": "`offset` takes its place", "is_active": "it is `active`"}
    renamed: ClassVar[Mapping[str, Mapping[str, tuple[str, Any]]]] = {"is_active": {"false": ("active", False)}}


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Return a function that writes arm.yaml into the working directory."""
    monkeypatch.chdir(tmp_path)

    def write_text(text: str) -> str:
        (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")
        return "arm.yaml"

    return write_text


def test_a_record_holds_values_and_knows_their_places(write):
    file = write("robot:\n  arm:\n    name: left\n    gains: [1, 2e0]\n    springs:\n      elbow: {stiffness: 1e3}\n")
    arm = read(file, SpringArm, ("robot", "arm"))
    assert (arm.name, arm.gains, arm.offset) == ("left", (1.0, 2.0), (0.0, 0.0, 0.0))
    assert arm.springs["elbow"].stiffness == 1000.0
    assert arm.springs["elbow"].where("stiffness") == "arm.yaml:6:26: robot.arm.springs.elbow.stiffness"
    assert arm.where("gains", 1) == "arm.yaml:4:16: robot.arm.gains[1]"
    assert arm.where() == "arm.yaml:2:3: robot.arm"
    assert arm.where("offset") == arm.where()  # not written: the nearest place


def test_records_are_equal_by_value_not_by_place(write):
    first = read(write("name: a\n"), SpringArm)
    second = read(write("\n\nname: a\n"), SpringArm)
    assert first == second == SpringArm(name="a")
    assert first != read(write("name: b\n"), SpringArm)
    assert hash(Spring(stiffness=1.0)) == hash(Spring(stiffness=1.0))


def test_a_key_without_value_is_not_given(write):
    arm = read(write("name: a\nactive:\nsprings:\n  elbow: {stiffness: 1, kind: }\n"), SpringArm)
    assert arm.active is True
    assert arm.springs["elbow"].kind == "SEA"


def test_an_obsolete_key_is_reported(write, caplog):
    with caplog.at_level(logging.WARNING):
        read(write("name: a\nold: 3\n"), SpringArm)
    assert "arm.yaml:2:1: old: has no effect: nothing uses it" in caplog.text


def test_a_key_of_an_earlier_version_names_what_takes_its_place(write, caplog):
    with caplog.at_level(logging.WARNING):
        arm = read(write("name: a\nis_active: false\n"), SpringArm)
    assert not arm.active
    assert "arm.yaml:2:1: is_active: the key 'is_active' is no more: `active: False` takes its place" in caplog.text
    for line, successor in (("reach: 2", "`offset` takes its place"), ("is_active: [1]", "it is `active`")):
        with pytest.raises(ConfigError, match=f"2:1: .* is no more: {successor}"):
            read(write(f"name: a\n{line}\n"), SpringArm)


@pytest.mark.parametrize(
    ("line", "where", "what", "names"),
    [
        ("active: yes", "2:9: active", "expected true or false, got 'yes'", ()),
        ("active: 1", "2:9: active", "expected true or false, got 1", ()),
        ("name: 5", "2:7: name", "expected a text, got 5", ()),
        ("gains: fast", "2:8: gains", "expected a number or a list, got 'fast'", ()),
        ("gains: [1, x]", "2:12: gains[1]", "expected a number, got 'x'", ()),
        ("gains: {a: 1}", "2:8: gains", "expected a number or a list, got a map", ()),
        ("offset: [1, 2]", "2:9: offset", "expected a longer list, got a list of 2", ()),
        ("offset: [1, 2, 3, 4]", "2:9: offset", "expected a list of at most 3 values, got a list of 4", ()),
        ("offset: [1, '2', 3]", "2:13: offset[1]", "expected a number, got '2'", ()),
        ("springs: {e: {stiffness: -1}}", "2:26: springs.e.stiffness", "expected a number above 0, got -1", ()),
        ("springs: {e: {stiffness: 1.e999}}", "2:26: springs.e.stiffness", "expected a finite number, got inf", ()),
        ("springs: {e: {stiffness: true}}", "2:26: springs.e.stiffness", "expected a number, got true", ()),
        ("springs: {e: {}}", "2:11: springs.e", "the key 'stiffness' is missing", ()),
        ("springs: {e: {stiffness: }}", "2:15: springs.e.stiffness", "the key 'stiffness' has no value", ()),
        ("springs: [1]", "2:10: springs", "expected a map of keys, got a list of 1", ()),
        ("springs: {e: 3}", "2:14: springs.e", "expected a map of keys, got 3", ()),
        ("springs: {e: {stiffness: 1, kind: sea}}", "2:35: springs.e.kind", "expected 'SEA' or 'PEA', got 'sea'",
         ("SEA", "PEA")),
        ("springs: {e: {stiffness: 1, stages: 1.5}}", "2:37: springs.e.stages", "expected a whole number, got 1.5", ()),
        ("list_of: [a, 3]", "2:14: list_of[1]", "expected a text, got 3", ()),
        ("list_of: a", "2:10: list_of", "expected a list, got 'a'", ()),
        ("tools: hook", "2:8: tools", "expected a valid array, got 'hook'", ()),
    ],
)  # fmt: skip
def test_errors_contain_place_expected_and_got(write, line, where, what, names):
    text = f"\n{line}\n" if line.startswith("name") else f"name: a\n{line}\n"
    with pytest.raises(ConfigError) as caught:
        read(write(text), SpringArm)
    assert (caught.value.where, caught.value.what, caught.value.names) == (f"arm.yaml:{where}", what, names)


def test_an_unknown_key_names_the_nearest(write):
    with pytest.raises(UnknownName) as caught:
        read(write("name: a\nsprings:\n  e: {stiffnes: 1, stiffness: 2}\n"), SpringArm)
    assert caught.value.where == "arm.yaml:3:7: springs.e.stiffnes"
    assert caught.value.names[0] == "stiffness"


def test_a_missing_key_is_explained(write):
    with pytest.raises(ConfigError) as caught:
        read(write("active: true\n"), SpringArm)
    assert caught.value.expected == "name of the arm"


def test_all_mistakes_are_reported_from_top_to_bottom(write):
    with pytest.raises(SolferErrors) as caught:
        read(write("springs:\n  e: {stiffness: x, kind: y}\nnam: b\nactive: 3\n"), SpringArm)
    places = [error.where.split(":")[1] for error in caught.value.errors]
    assert places == ["2", "2", "3", "4"]  # `nam` is a misspelt `name`, which is not missing besides


def test_a_missing_file_names_its_neighbours(write):
    write("name: a\n")
    with pytest.raises(ConfigError) as caught:
        read("arms.yaml", SpringArm)
    assert caught.value.what == "there is no file 'arms.yaml'"
    assert caught.value.names == ("arm.yaml",)


@pytest.mark.parametrize(("path", "what"), [("no/arm.yaml", "nor a folder 'no'"), (".", "'.' is a folder"), ("\0", "")])
def test_paths_that_are_no_files(write, path, what):
    with pytest.raises(ConfigError) as caught:
        read(path, SpringArm)
    assert what in caught.value.what


def test_a_binary_file_is_placed(write, tmp_path):
    (tmp_path / "arm.yaml").write_bytes(b"name: a\nx: \xff\xfe\n")
    with pytest.raises(ConfigError) as caught:
        read("arm.yaml", SpringArm)
    assert (caught.value.where, caught.value.what) == ("arm.yaml:2:4", "not a text in UTF-8")


def test_a_missing_root_names_the_found_keys(write):
    with pytest.raises(ConfigError) as caught:
        read(write("robto:\n  arm: {name: a}\n"), SpringArm, ("robot", "arm"))
    assert caught.value.what == "there is no 'robot' here; robto found instead"


class Holder(Record):
    """Something with a text elsewhere."""

    urdf: TextRecord = Field(description="URDF")


@pytest.mark.parametrize(
    ("value", "parameter", "location"),
    [
        ("/robot", "/robot", None),
        ("{file: a/b.urdf}", None, "sub/a/b.urdf"),
        ("{path: ../x, file: b.urdf}", None, "x/b.urdf"),
        ("{path: /abs, file: b.urdf}", None, "/abs/b.urdf"),
        ("{path: ignored, file: /abs/b.urdf}", None, "/abs/b.urdf"),
    ],
)
def test_texts_are_parameters_or_files(write, tmp_path, value, parameter, location):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/h.yaml").write_text(f"urdf: {value}\n")
    urdf = read("sub/h.yaml", Holder).urdf
    assert urdf.parameter == parameter
    assert (None if urdf.location is None else str(urdf.location)) == location


@pytest.mark.needs("ros")
@pytest.mark.parametrize("text", ["package://solfer_arms/urdf/a.urdf", "$(find solfer_arms)/urdf/a.urdf"])
def test_files_of_ros_packages(write, tmp_path, monkeypatch, text):
    (tmp_path / "solfer_arms").mkdir()
    (tmp_path / "solfer_arms/package.xml").write_text("<package><name>solfer_arms</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert read(write(f"urdf: {{file: {text}}}\n"), Holder).urdf.location == tmp_path / "solfer_arms/urdf/a.urdf"
    with pytest.raises(UnknownName) as caught:
        assert read(write(f"urdf: {{file: {text.replace('arms', 'arm')}}}\n"), Holder).urdf.location
    assert caught.value.where == "arm.yaml:1:14: urdf.file"
    assert caught.value.names[0] == "solfer_arms"
