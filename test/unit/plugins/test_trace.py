"""Plugins that share a Robot, cycle by cycle: what is read, computed and published, in which order and why."""

import numpy as np
import pytest
from support.plugins.fleet import Fleet, still, tree

from solfer.plugins import CycleTrace, PluginState, TraceLog
from solfer.plugins.trace import cycles

NAMES = ("first", "second", "third")
READER, ESTIMATOR, BALANCE = (f"support.plugins.fleet:{name}" for name in ("Reader", "Estimator", "Balance"))


def estimated():
    """Return a configuration in which the second of three plugins writes the base of their Robot and publishes it."""
    changed = tree()
    changed["modules"]["second"] |= {"class": ESTIMATOR, "model_change": True, "controller": ["base"]}
    changed["modules"]["third"] |= {"robot": "based", "controller": ["left"]}
    return changed


def test_one_cycle_has_the_order_of_the_list(tmp_path):
    fleet = Fleet(tmp_path, estimated(), NAMES)
    fleet.cycle(**still())
    trace = CycleTrace(fleet.plugins)
    fleet.cycle(**still(shoulder=0.3))
    assert trace.of(1) == [
        "first reads joints",
        "first computes kinematics because of joints",
        "second writes",
        "second publishes base",
        "third computes kinematics because of second",
        "third publishes left",
    ]


def test_first_cycles_are_logged_on_request(tmp_path, caplog):
    caplog.set_level("INFO", "solfer.plugins.trace")
    fleet = Fleet(tmp_path, estimated(), NAMES)
    log = TraceLog(fleet.plugins, 2)
    for shoulder in np.linspace(0.1, 0.5, 6):
        log.poll()
        fleet.cycle(**still(shoulder=shoulder))
    lines = [record.getMessage() for record in caplog.records]
    assert lines[:2] == ["cycle 1 first reads joints", "cycle 1 first computes kinematics because of joints"]
    assert [sum(line.startswith(f"cycle {number} ") for line in lines) for number in (1, 2, 3)] == [6, 6, 0]
    assert not any("cycle" in vars(plugin) for plugin in fleet.plugins)


@pytest.mark.parametrize("text", ["-1", "two", "1.5", ""])
def test_only_whole_numbers_of_cycles_are_accepted(text):
    assert cycles("0") == 0
    with pytest.raises(ValueError, match=f"^{text}$"):
        cycles(text)


def test_a_reader_after_no_change_computes_nothing(tmp_path):
    """Each element is computed once after a change, at its first use; and the trace leaves no wrapper behind."""
    changed = tree()
    changed["modules"]["second"] |= {"class": BALANCE, "dynamics": True}
    changed["modules"]["third"] |= {"class": BALANCE, "dynamics": True}
    fleet = Fleet(tmp_path, changed, NAMES)
    fleet.cycle(**still())
    trace, robot = CycleTrace(fleet.plugins), fleet.plugins[0].robot
    before = robot.computations()
    fleet.cycle(position=[0.4, 0.1], velocity=[1.0, 2.0])
    once = ("kinematics", "center_of_mass", "inertia", "bias")
    assert {name: robot.computations()[name] - before[name] for name in once} == dict.fromkeys(once, 1)
    assert trace.of(1) == [
        "first reads joints",
        "first computes kinematics because of joints",
        "second computes center_of_mass because of joints",
        "second computes inertia because of joints",
        "second computes bias because of joints",
    ]
    between = robot.computations()
    fleet.cycle()
    assert trace.of(2) == [] and robot.computations() == between
    trace.close()
    fleet.cycle(**still())
    assert len(trace.events) == 5
    assert not any("update" in vars(each) for each in (robot.kinematics, *fleet.plugins))


def test_a_late_reader_reads_what_nobody_read_before(tmp_path):
    changed = tree()
    changed["modules"]["second"]["robot"] = "imu"
    fleet = Fleet(tmp_path, changed, NAMES)
    trace = CycleTrace(fleet.plugins)
    fleet.asleep.add("first")
    fleet.cycle(**still())
    assert [event.plugin for event in trace.events if event.does == "reads"] == ["second"]
    fleet.asleep.clear()
    fleet.cycle(**still(roll=0.7))
    assert [event.plugin for event in trace.events if event.does == "reads"] == ["second", "first"]
    assert {event.robot for event in trace.events} == {NAMES}


def test_a_written_base_makes_the_next_reader_wait(tmp_path):
    """A base that another plugin writes counts as feedback: it must have arrived, and it grows old."""
    fleet = Fleet(tmp_path, estimated(), ("third", "second"))
    third, second = fleet.plugins
    fleet.asleep.add("second")
    for _ in range(3):
        fleet.cycle(**still())
    assert third.life is PluginState.STARTING and not third.feedbacks[1].received
    fleet.asleep.clear()
    fleet.cycle(**still())
    fleet.cycle(**still())
    assert third.life is PluginState.RUNNING and third.feedbacks[1].accepted == 1
    assert fleet.bus.time - third.feedbacks[1].arrival < 0.01
    seen = third.component.seen[-1][0]
    assert np.array_equal(seen[[0, 4]], [0.01, 0.001]) and second.robot.shares_measurement(third.robot)
    fleet.asleep.add("second")  # what it wrote grows old
    for _ in range(200):
        fleet.cycle(**still())
    assert third.life is PluginState.STARTING
