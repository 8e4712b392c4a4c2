"""A plugin commands no joint that nothing measures: not at its start, nor after one of several drivers has ended."""

import logging

import numpy as np
import pytest
from support.walk import benches
from support.walk.files import write

from solfer.config import load
from solfer.errors import PipeError
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, generate
from solfer.plugins.plugin import PluginState
from solfer.transport.messages import JointMessage

IN = "feedback/joints/"
OUT = "controller/"
BOTH = ["arm_controller", "wheel_controller"]
HALVES = {
    "ros/feedback/joints/source": "halves",
    "feedbacks/some": ["joints"],
    "controllers/few": BOTH,
    OUT + "arm_controller/filter": None,
    IN + "dofs/mapping": "FEEDBACK",
    IN + "filter": None,
    IN + "timeout": 0.1,
}
HOME = dict(zip(benches.JOINTS, (0.02, -0.03, 0.04), strict=True))  # [rad]
DRIVERS = [(("shoulder", "elbow"), ("roll",)), (("roll",), ("elbow", "shoulder"))]


@pytest.fixture(autouse=True)
def holding(monkeypatch):
    """Let the component hold all joints where they start."""

    def hold(component):
        component.model.command.position[:] = component.start_position

    monkeypatch.setattr(benches.Walker, "update", hold)


class Halves:
    """A plugin on a robot whose joints have several drivers, which publish on one topic."""

    def __init__(self, folder, first, **changes):
        write(folder, HALVES | changes)
        self.others = benches.Others(folder)
        self._drivers = {}
        self.publish(first)
        self.sent = MemoryMiddleware(self.others.bus, "ear").queue("arm_controller/command", "solfer/JointCommand")
        configuration = load(folder / "main.yaml", "sets")
        generator = Registry().find("sets", configuration.module.class_)
        self.plugin = generate(configuration, MemoryMiddleware(self.others.bus, "sets"), generator)

    def publish(self, names):
        """Publish joints where they are at home, by a driver of their own."""
        bus, topic = self.others.bus, ("halves", "sensor_msgs/JointState")
        driver = self._drivers.setdefault(names[0], MemoryMiddleware(bus, f"driver_of_{names[0]}").writer(*topic))
        noise = 1e-6 * np.sin(1e3 * bus.time)  # a sensor whose numbers stay is frozen
        position = np.array([HOME[name] + noise for name in names])
        driver.write(JointMessage(names, position, np.zeros(len(names)), np.zeros(len(names)), stamp=bus.time))

    def run(self, duration, *drivers):
        """Let drivers publish and the plugin cycle so long [s]; return where the first command begins, by name."""
        for _ in range(round(duration * self.plugin.rate)):
            self.others.bus.run_until(self.others.bus.time + 1.0 / self.plugin.rate)
            for names in drivers:
                self.publish(names)
            self.plugin.cycle()
        return next((dict(zip(each.names, each.position, strict=True)) for each in self.sent.drain()), None)

    @property
    def at_home(self):
        """Where the joints of the arm's controller are."""
        return {name: HOME[name] for name in benches.JOINTS[:2]}

    @property
    def running(self):
        return self.plugin.life is PluginState.RUNNING


@pytest.mark.parametrize("drivers", DRIVERS)
def test_a_start_waits_for_all_drivers(tmp_path, drivers, caplog):
    """Whoever publishes first: the order is that of the first message, and all joints begin where they are."""
    caplog.set_level(logging.INFO)
    halves = Halves(tmp_path, drivers[0])
    assert halves.plugin.robot.maps["FEEDBACK"].external[: len(drivers[0])] == drivers[0]
    assert halves.run(0.5, drivers[0]) is None and not halves.running
    missing = ", ".join(name for name in benches.JOINTS if name in drivers[1])
    assert f"waits for feedback {missing} of 'joints' (halves)" in halves.plugin.health()[1]
    assert f"waits for feedback {missing} of 'joints' (halves)" in caplog.text
    assert halves.run(0.5, *drivers) == pytest.approx(halves.at_home, abs=1e-5) and halves.running


@pytest.mark.parametrize("drivers", DRIVERS)
def test_a_plugin_holds_without_one_of_its_drivers(tmp_path, drivers, caplog):
    """It goes on when that driver is back, and after a restart it waits for all of them again."""
    halves = Halves(tmp_path, drivers[0])
    halves.run(0.5, *drivers)
    assert halves.running
    halves.run(0.5, drivers[0])
    silent = f"driver_of_{drivers[1][0]}"
    assert not halves.running and f"nothing new of {silent} for 0.1" in caplog.text
    assert f"waits for feedback 'joints' (halves), where {silent} is silent" in halves.plugin.health()[1]
    halves.run(0.5, *drivers)
    assert halves.running
    halves.plugin.stop()
    halves.plugin.restart()
    halves.run(0.5, drivers[1])
    assert not halves.running
    halves.run(0.5, *drivers)
    assert halves.running


@pytest.mark.parametrize("lost", [("roll",), ("elbow", "roll")])
def test_a_driver_that_leaves_joints_out_is_a_timeout(tmp_path, lost, caplog):
    """Its other messages go on, under the same name; so does the plugin when the joints are back, in any order."""
    halves = Halves(tmp_path, benches.JOINTS)
    halves.run(0.5, benches.JOINTS)
    assert halves.running
    rest = tuple(name for name in benches.JOINTS if name not in lost)
    halves.run(0.5, rest)
    assert not halves.running and f"nothing new of driver_of_shoulder ({', '.join(lost)}) for 0.1" in caplog.text
    halves.run(0.5, ("shoulder", "roll", "elbow"))
    assert halves.running
    for _ in range(20):  # messages with other joints in turn
        halves.run(0.02, ("shoulder", "elbow"))
        halves.run(0.02, ("shoulder", "roll"))
    assert halves.running


@pytest.mark.parametrize(
    ("chain", "pipe", "missing"), [("arm", "wheel_controller", "roll"), ("wheels", "arm_controller", "shoulder, elbow")]
)
def test_joints_without_a_feedback_need_open_loop(tmp_path, chain, pipe, missing):
    with pytest.raises(PipeError, match=f"'{pipe}' commands joints that no feedback measures: {missing}\\n"):
        Halves(tmp_path, benches.JOINTS, **{IN + "dofs/chain": chain})
    halves = Halves(tmp_path, benches.JOINTS, **{IN + "dofs/chain": chain, f"{OUT}{pipe}/open_loop": True})
    halves.run(0.5, benches.JOINTS)
    assert halves.running


@pytest.mark.parametrize("chain", ["all", "arm", "wheels"])
def test_a_driver_of_other_joints_is_no_fault(tmp_path, chain, caplog):
    """The plugin commands the arm, or the wheel: it neither waits for the other joints nor needs them."""
    own, others = DRIVERS[0] if chain != "wheels" else reversed(DRIVERS[0])
    pipe = BOTH[chain == "wheels"]
    halves = Halves(tmp_path, own, **{"controllers/few": [pipe], IN + "dofs/chain": chain})
    (feedback,) = halves.plugin.feedbacks
    halves.run(0.5, own)
    assert halves.running
    for drivers in ((own, others), (own,), (others, own)):
        halves.run(0.5, *drivers)
        assert halves.running and not feedback.refused
    assert not any("refuse" in text for text in caplog.messages)
    halves.run(0.5, others)
    assert not halves.running and "refuse" not in halves.plugin.health()[1]


@pytest.mark.parametrize(("chain", "driver"), [("arm", ("roll",)), ("wheels", ("shoulder", "elbow"))])
def test_other_joints_alone_are_named_as_the_reason(tmp_path, chain, driver, caplog):
    halves = Halves(tmp_path, driver, **{"controllers/few": [BOTH[chain == "wheels"]], IN + "dofs/chain": chain})
    halves.run(0.5, driver)
    reason = f"(halves), which refuses messages of driver_of_{driver[0]}: it has none of the pipe's {3 - len(driver)} "
    assert not halves.running and reason in halves.plugin.health()[1]
    assert not any(record.levelno >= logging.WARNING for record in caplog.records)
