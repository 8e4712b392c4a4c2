"""What a component logs: its arrays, filled after each send, and the error of one that cannot declare them."""

import numpy as np
import pytest
from support.plugins.fleet import RATE, Fleet, still, tree

from solfer.components import Component
from solfer.errors import ComponentError
from solfer.recording.model import COLUMNS_KIND
from solfer.telemetry.plugin_log import PluginLog


class Logs(Component):
    """Fills what it logs when it is asked to."""

    def start_log(self, logger):
        self.row = np.zeros(2)
        logger.add("row", self.row, ("time", "calls"), ("s", ""))

    def log(self, logger, time):
        self.row[0] = time
        self.row[1] += 1


def test_component_is_asked_after_each_send(tmp_path, monkeypatch):
    fleet = Fleet(tmp_path, tree(), ("first",))
    plugin = fleet.plugins[0]
    monkeypatch.setattr(type(plugin.component), "start_log", Logs.start_log)
    monkeypatch.setattr(type(plugin.component), "log", Logs.log)
    sources = {each.channel.name: each for each in PluginLog(plugin).sources}
    row = sources["first/log/row"]
    for _ in range(3):
        fleet.cycle(**still())
    assert row.array is plugin.component.row and row.array[1] == 3 and row.array[0] >= 0.0
    assert row.channel.columns == ("time", "calls") and row.channel.units == ("s", "")


def test_points_are_logged_by_their_columns(tmp_path):
    """Columns and units follow from each pipe's quantity and names, and arrays are the ports' own, not copies."""
    changed, names = tree(), {"names": ["left", "right"], "space": "POINTS"}
    changed["modules"]["first"] |= {"class": "support.plugins.fleet:Ported", "controller": ["push", "feet"]}
    changed["robot"]["jointed"]["feedback"]["list"] += ["goal", "marks"]
    changed["feedback"]["goal"] = {"space": "POINT", "quantity": "pose"}
    changed["feedback"]["marks"] = names | {"quantity": "position"}
    changed["controller"]["push"] = {"space": "POINT", "quantity": "force", "type": "reference"}
    changed["controller"]["feet"] = changed["controller"]["push"] | names
    several, ros = "solfer/RobotPoints", changed["ros"]
    ros["feedback"]["goal"] = {"source": "goal", "message": "geometry_msgs/PoseStamped"}
    ros["feedback"]["marks"] = {"source": "marks", "message": several}
    ros["controller"]["push"] = {"sink": "push", "message": "geometry_msgs/Vector3Stamped"}
    ros["controller"]["feet"] = {"sink": "feet", "message": several}
    plugin = Fleet(tmp_path, changed, ("first",)).plugins[0]
    inputs, made = plugin.component.inputs, {each.channel.name: each for each in PluginLog(plugin).sources}
    goal, marks = (made[f"first/feedback/{name}/value"] for name in ("goal", "marks"))
    push, feet = (made[f"first/command/{name}"] for name in ("push", "feet"))
    assert goal.array is inputs["goal"].value and marks.array is inputs["marks"].value
    assert [(each.channel.kind, each.channel.columns, each.channel.units) for each in (goal, marks, push, feet)] == [
        ("geometry_msgs/PoseStamped", ("x", "y", "z", "qx", "qy", "qz", "qw"), ("m",) * 3 + ("",) * 4),
        (COLUMNS_KIND, ("0 x", "0 y", "0 z", "1 x", "1 y", "1 z"), ("m",) * 6),
        ("geometry_msgs/Vector3Stamped", ("x", "y", "z"), ("N",) * 3),
        (COLUMNS_KIND, ("left 0", "left 1", "left 2", "right 0", "right 1", "right 2"), ("",) * 6),
    ]


def test_numbers_are_taken_of_the_newest_cycle(tmp_path):
    """Ages grow while nothing arrives, timings are of the last cycle, and slides have other units than turns."""
    changed = tree()
    changed["modules"]["first"]["controller"] = ["left"]
    fleet = Fleet(tmp_path, changed, ("first",))
    plugin, robot = fleet.plugins[0], fleet.plugins[0].robot
    log = PluginLog(plugin)
    made = {each.channel.name.removeprefix("first/"): each for each in log.sources}
    fleet.cycle(**still(0.3, 0.4))
    fleet.cycle()  # nothing arrives
    log.take(fleet.bus.time + 1.5)
    assert made["timing"].array.tolist() == list(plugin.timing.times) and made["timing"].factor == 1e-9
    passed = plugin.component.passed
    assert made["life"].array.tolist() == [plugin.life, plugin.outputs.blend.shortest, passed, 0.0] and passed > 0.0
    assert made["feedback/joints/age"].array[0] == pytest.approx(1.5 + 2.0 / RATE)
    position = made["feedback/joints/position"]
    assert dict(zip(position.channel.columns, position.array, strict=True)) == {"shoulder": 0.3, "roll": 0.4}
    for title, state in (("measured", robot.state), ("wanted", robot.command)):
        for field, interface, slides, turns in (
            ("position", "position", "m", "rad"),
            ("velocity", "velocity", "m/s", "rad/s"),
            ("effort", "torque", "N", "Nm"),
        ):
            source = made[f"{title}/{field}"]
            assert source.array is state[interface] and source.channel.columns == robot.dofs
            assert source.channel.units == (slides,) * 3 + (turns,) * (robot.size - 3)
    sent = made["command/left/position"]
    assert sent.array is plugin.outputs.controllers[0][0].sent.position and (sent.array > 500.0).all()


def test_component_that_cannot_declare_is_named(tmp_path, monkeypatch):
    plugin = Fleet(tmp_path, tree(), ("first",)).plugins[0]
    monkeypatch.setattr(type(plugin.component), "start_log", lambda self, logger: logger.nothing)
    with pytest.raises(ComponentError, match="the component of 'first' cannot declare what it logs"):
        PluginLog(plugin)


def test_reset_of_component_is_noted(tmp_path):
    fleet = Fleet(tmp_path, tree(), ("first",))
    plugin = fleet.plugins[0]
    plugin.requests.enabled = True
    for _ in range(3):
        fleet.cycle(**still())
    assert plugin.running and plugin.requests.notes == []
    for _ in range(60):
        fleet.cycle()
    ((kind, text),) = plugin.requests.notes
    assert kind == "reset" and text.startswith("waits for feedback 'joints'")
