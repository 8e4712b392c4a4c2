"""The rule who shares a Robot, and what may feed it."""

import pytest
from support.plugins.fleet import Fleet, loaded, tree

from solfer.errors import PipeError, SolferErrors
from solfer.plugins.sharing.groups import apart, conflicts, robot_groups, writing_of

NAMES = ("first", "second")


def grouped(folder, changed, names=NAMES):
    return [[each.name for each in group] for group in robot_groups(loaded(folder, changed, names))]


@pytest.mark.parametrize(
    "tags",
    [
        {},
        {"robot": "based"},
        {"robot": "deaf"},
        {"robot": "encoded"},
        {"robot": "smooth"},
        {"model_change": True, "controller": ["base"]},
        {"dynamics": True, "kinematics": False},
        {"mode": "idle"},
    ],
)
def test_what_plugins_receive_keeps_none_apart(tmp_path, tags):
    changed = tree()
    changed["modules"]["second"] |= tags
    assert grouped(tmp_path, changed) == [["first", "second"]]


@pytest.mark.parametrize(
    ("tags", "share"),
    [
        ({}, True),
        ({"dynamics": True, "mode": "idle"}, True),
        ({"robot": "based"}, False),
        ({"robot": "deaf"}, False),
        ({"robot": "smooth"}, False),
        ({"model_change": True}, False),
    ],
)
def test_plugins_of_no_shared_plugin_share_less(tmp_path, tags, share):
    changed = tree()
    changed["modules"]["second"] |= tags
    groups = robot_groups(loaded(tmp_path, changed, NAMES), ["", ""])
    assert [[each.name for each in group] for group in groups] == (
        [["first", "second"]] if share else [["first"], ["second"]]
    )


def test_robots_are_shared_within_one_shared_plugin(tmp_path):
    names = ("first", "second", "third")
    groups = robot_groups(loaded(tmp_path, tree(), names), ["one", "other", "one"])
    assert [[each.name for each in group] for group in groups] == [["first", "third"], ["second"]]


@pytest.mark.parametrize(
    ("words", "laid_over"),
    [
        ("model", {"ros": {"source": {"urdf": "/other"}}}),
        ("model", {"ros": {"source": {"srdf": "/other"}}}),
        ("model", {"robot": {"name": "other"}}),
        ("system", {"system": "HW"}),
        ("rate", {"robot": {"rate": 100.0}}),
        ("maps", {"ros": {"mapping": {"HALF": {"loading": "model", "urdf": "/half"}}}}),
        ("contacts", {"robot": {"jointed": {"contacts": {"read": True}}}, "ros": {"source": {"contacts": "/c"}}}),
        ("actuators", {"robot": {"jointed": {"actuators": {"read": True}}}, "ros": {"source": {"actuators": "/a"}}}),
    ],
)
def test_what_describes_a_robot_keeps_apart(tmp_path, words, laid_over):
    changed = tree()
    one = loaded(tmp_path, changed, NAMES)[0]
    (tmp_path / "other").mkdir()
    for key, value in laid_over.items():
        changed[key] = _merged(changed.get(key), value)
    other = loaded(tmp_path / "other", changed, NAMES)[1]
    assert apart(one, other) == (words,) and len(robot_groups([one, other])) == 2


def _merged(old, new):
    if not isinstance(new, dict) or not isinstance(old, dict):
        return new
    return old | {key: _merged(old.get(key), value) for key, value in new.items()}


def test_unread_descriptions_keep_none_apart(tmp_path):
    changed = tree()
    one = loaded(tmp_path, changed, NAMES)[0]
    (tmp_path / "other").mkdir()
    changed["ros"]["source"] |= {"actuators": "/a", "contacts": "/c"}
    assert apart(one, loaded(tmp_path / "other", changed, NAMES)[1]) == ()


def refused(folder, changed, names=NAMES):
    with pytest.raises(PipeError, match="has two sources") as caught:
        Fleet(folder, changed, names)
    return caught.value


def place(folder, name):
    """Return the line of a source in the file."""
    lines = (folder / "main.yaml").read_text().split("\n")
    start = next(index for index, line in enumerate(lines) if line.startswith("  ros:"))
    begin = next(index for index, line in enumerate(lines[start:], start) if line == f"      {name}:")
    return f"main.yaml:{1 + next(index for index, line in enumerate(lines) if index > begin and 'source:' in line)}:"


@pytest.mark.parametrize(
    ("robots", "pipes", "number"),
    [
        (("jointed", "encoded"), ("joints", "encoders"), "position of 'shoulder'"),
        (("based", "tracked"), ("base", "tracker"), "position of 'x'"),
        (("imu", "tracked"), ("imu", "tracker"), "position of 'rx'"),
        (("jointed", "smooth"), ("joints", "smooth"), "position of 'roll'"),
    ],
)
def test_two_sources_are_refused_with_both_places(tmp_path, robots, pipes, number):
    changed = tree()
    for name, robot in zip(NAMES, robots, strict=True):
        changed["modules"][name]["robot"] = robot
    error = refused(tmp_path, changed)
    assert number in str(error) and f"'first', which shares its Robot, by '{pipes[0]}'" in str(error)
    assert place(tmp_path, pipes[1]) in error.where and place(tmp_path, pipes[0]) in error.expected


def test_different_dofs_have_different_sources(tmp_path):
    changed = tree()
    changed["feedback"]["joints"]["dofs"] = {"chain": "wheels", "type": "all", "mapping": "RBDL"}
    changed["modules"]["second"]["robot"] = "encoded"
    first, second = Fleet(tmp_path, changed, NAMES).plugins
    assert first.robot.shares_measurement(second.robot)


def test_one_plugin_may_have_two_sources(tmp_path):
    changed = tree()
    changed["robot"]["both"] = changed["robot"]["imu"] | {"feedback": {"list": ["joints", "encoders"]}}
    changed["modules"]["first"]["robot"], changed["modules"]["second"]["robot"] = "both", "deaf"
    Fleet(tmp_path, changed, NAMES)


def test_who_changes_the_model_owns_its_input(tmp_path):
    changed = tree()
    changed["modules"]["first"] |= {"robot": "imu", "model_change": True}
    changed["modules"]["second"]["robot"] = "tracked"
    Fleet(tmp_path, changed, NAMES)
    changed["modules"]["second"]["model_change"] = True
    assert "position of 'rx'" in str(refused(tmp_path, changed))
    changed["modules"]["third"] |= {"robot": "tracked"}
    changed["modules"]["first"]["model_change"] = False
    changed["modules"]["second"] |= {"robot": "imu", "model_change": False}
    assert "'third' receives it by 'tracker'" in str(refused(tmp_path, changed, ("first", "second", "third")))


def test_what_the_group_publishes_is_no_outside_source(tmp_path):
    changed = tree()
    changed["modules"]["first"] |= {"robot": "imu", "controller": ["wanted_base"]}
    changed["modules"]["second"]["robot"] = "based"
    Fleet(tmp_path, changed, NAMES)


@pytest.mark.parametrize(
    ("tags", "pipe", "feedback", "found"),
    [
        ({}, {}, {}, True),
        ({"model_change": False}, {}, {}, False),
        ({}, {"function": "reference"}, {}, False),
        ({}, {"interface": {"velocity": True}}, {}, False),
        ({}, {"filter": {"frequency": 20.0}}, {}, False),
        ({}, {}, {"filter": {"frequency": 20.0}}, False),
        ({}, {}, {"function": "reference"}, False),
    ],
)
def test_written_state_counts_as_read(tmp_path, tags, pipe, feedback, found):
    changed = tree()
    changed["modules"]["first"] |= {"model_change": True, "controller": ["base"]} | tags
    changed["modules"]["second"]["robot"] = "based"
    changed["controller"]["base"] = changed["controller"]["base"] | pipe
    changed["feedback"]["base"] = changed["feedback"]["base"] | feedback
    group = loaded(tmp_path, changed, NAMES)
    received = next(record for record in group[1].feedbacks if record.name == "base")
    writing = writing_of(received, group[1], group)
    assert (writing is not None and (writing.plugin, writing.pipe) == ("first", "base")) == found
    assert writing_of(received, group[0], group) is None


@pytest.mark.parametrize(("key", "value"), [("source", "elsewhere"), ("message", "sensor_msgs/JointState")])
def test_another_topic_or_message_is_received(tmp_path, key, value):
    changed = tree()
    changed["modules"]["first"] |= {"model_change": True, "controller": ["base"]}
    changed["modules"]["second"]["robot"] = "based"
    changed["ros"]["feedback"]["base"][key] = value
    group = loaded(tmp_path, changed, NAMES)
    received = next(record for record in group[1].feedbacks if record.name == "base")
    assert writing_of(received, group[1], group) is None


def test_conflicts_are_found_without_a_robot(tmp_path):
    changed = tree()
    changed["modules"]["first"]["robot"], changed["modules"]["second"]["robot"] = "based", "tracked"
    (error,) = conflicts(loaded(tmp_path, changed, NAMES))
    assert "unactuated of all" in str(error) and place(tmp_path, "tracker") in error.where
    changed["modules"]["second"]["robot"] = "based"
    assert conflicts(loaded(tmp_path, changed, NAMES)) == []


def test_every_conflict_of_a_plugin_is_reported(tmp_path):
    changed = tree()
    changed["robot"]["wrong"] = changed["robot"]["imu"] | {"feedback": {"list": ["encoders", "tracker"]}}
    changed["modules"]["first"]["robot"], changed["modules"]["second"]["robot"] = "based", "wrong"
    with pytest.raises(SolferErrors) as caught:
        Fleet(tmp_path, changed, NAMES)
    assert ["has two sources" in str(error) for error in caught.value.errors] == [True, True]
