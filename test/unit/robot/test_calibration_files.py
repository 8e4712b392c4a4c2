"""Mistakes in the calibration of the shipped hardware.yaml: one clear error each, with its place."""

import numpy as np
import pytest
import yaml

from solfer.components import Service
from solfer.config import load
from solfer.errors import SolferError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.pipes import PipeContext, factory
from solfer.robot import build
from solfer.transport import JointMessage
from solfer.transport.middleware import JOINT_NAMES, JointNames, NoFields


@pytest.fixture
def files(repository, tmp_path):
    """Return a function that copies the configuration with `system: HW` and a changed hardware.yaml."""

    def make(old="", new="", count=1, main=lambda text: text):
        folder = tmp_path / "config"
        (folder / "support").mkdir(parents=True)
        (folder / "robots").symlink_to(repository / "config/robots")
        for path in (repository / "config/support").iterdir():
            text = path.read_text()
            if path.name == "hardware.yaml":
                assert old in text
                text = text.replace(old, new, count)
            (folder / "support" / path.name).write_text(text)
        text = (repository / "config/centauro.yaml").read_text()
        (folder / "centauro.yaml").write_text(main(text.replace("system: SM", "system: HW")))
        return folder / "centauro.yaml"

    return make


@pytest.fixture(scope="module")
def names(repository):
    """Map the model's names to the hardware's names in its order."""
    joints = yaml.safe_load((repository / "config/robots/centauro/hardware/mock.yaml").read_text())["joints"]
    return {joint: entry["name"] for joint, entry in joints.items()}


@pytest.fixture
def pipes(repository, names):
    """Make the Robot and all pipes of a configuration, with hardware that only publishes its joints."""
    urdf = (repository / "config/robots/centauro/centauro.urdf").read_text()
    whole = Description.from_text(urdf)
    bus = Bus(
        {
            "/robot_description": urdf,
            "/robot_semantic_description": (repository / "config/robots/centauro/centauro.srdf").read_text(),
            **{f"/robot_{keep}_body": cut(whole, "torso_2", keep) for keep in ("lower", "upper")},
        }
    )
    middleware = MemoryMiddleware(bus, "hardware")
    writer = middleware.writer("joint_states", "sensor_msgs/JointState")
    published = JointMessage(tuple(names.values()), *(np.zeros(len(names)) for _ in range(3)))
    bus.every(0.01, lambda: writer.write(published))
    for controller, wheels in (("position_controller", False), ("velocity_controller", True)):
        joints = tuple(name for joint, name in names.items() if joint.startswith("j_wheel") is wheels)
        service = Service(
            "get_joint_names",
            JOINT_NAMES,
            NoFields,
            JointNames,
            lambda _request, joints=joints: JointNames(names=joints),
        )
        middleware.serve(controller, (service,), _at_once)

    def make(file, module="joint_states", keep=lambda joint: True):
        published.names = tuple(name for joint, name in names.items() if keep(joint))
        published.position = published.velocity = published.effort = np.zeros(len(published.names))
        configuration = load(file, module)
        robot = build(configuration, middleware)
        context = PipeContext(robot, middleware, configuration.calibrations, configuration.rate)
        feedbacks = [factory.feedback(record, context) for record in configuration.feedbacks]
        controllers = [factory.controller(record, context) for record in configuration.controllers]
        return feedbacks, controllers

    return make


class _Done:
    """A Future that was never pending."""

    def __init__(self, value):
        self._value = value

    def done(self):
        return True

    def result(self, timeout=None):
        return self._value


def _at_once(call):
    return _Done(call())


def test_the_shipped_calibration_fits_every_joint(files, pipes, names):
    feedbacks, controllers = pipes(files())
    assert feedbacks[0].run()
    assert feedbacks[0].accepted == 1
    assert sorted(joint for pipe in controllers for joint in pipe.message.names) == sorted(names)


@pytest.mark.parametrize("late", ["arm1", "j_wheel"])
def test_joints_of_another_driver_may_come_later(files, pipes, late):
    """The pipe waits for those that the calibration names, by the names of the hardware."""
    feedbacks, _ = pipes(files(), keep=lambda joint: late not in joint)
    assert feedbacks[0].run() and not feedbacks[0].received
    assert len(feedbacks[0].lacks.split(", ")) == (7 if late == "arm1" else 4)


def test_calibrations_of_the_whole_serve_its_parts(files, pipes):
    feedbacks, controllers = pipes(files(), "joint_lower")
    assert feedbacks[0].run() and feedbacks[0].accepted == 1
    assert all("arm" not in name for pipe in controllers for name in pipe.message.names)


@pytest.mark.parametrize(
    ("old", "new", "texts"),
    [
        ("torso_yaw: ", "torso_jaw: ", ["unknown joint 'torso_jaw'", "did you mean: torso_yaw", ":8:9: "]),
        ("name: J01", "name: J1", ["unknown joint of the hardware 'J1'", "J01", "'torso_yaw'", ":8:31: "]),
        ("name: J01", "name: J11", ["'J11' stands for 'torso_yaw' and for 'j_arm2_1'", ":9:31: "]),
        ("{name: J01,", "{", ["unknown joint of the hardware 'torso_yaw'", ":8:9: "]),
        ("sign: -1", "sign: 2", ["expected 1 or -1, got 2", ":8:42: "]),
        ("offset: -0.162", "offset: left", ["expected a number, got 'left'", "torso_yaw.offset"]),
        ("offset: -0.162", "ofset: -0.162", ["unknown key 'ofset'", "did you mean: offset"]),
        ("calibration: encoders", "calibration: encoder",
         ["unknown calibration 'encoder'", "did you mean: encoders", "feedback.link_side_online.calibration"]),
        ("    velocity_controller: {calibration: encoders}\n", "",
         ["the pipe 'velocity_controller' has no calibration", "in all of them, or in none"]),
        ("      calibration: encoders\n", "", ["the pipe 'link_side_online' has no calibration"]),
    ],
)  # fmt: skip
def test_a_mistake_has_its_place(files, pipes, old, new, texts):
    with pytest.raises(SolferError) as caught:
        pipes(files(old, new))
    for text in texts:
        assert text in str(caught.value)
    if texts[-1].startswith(":"):
        assert f"hardware.yaml{texts[-1]}" in str(caught.value)


def test_a_joint_that_is_missing_is_named(files, pipes, repository):
    lines = (repository / "config/support/hardware.yaml").read_text().splitlines(keepends=True)
    line = next(line for line in lines if "knee_pitch_3:" in line)
    with pytest.raises(SolferError) as caught:
        pipes(files(line, ""))
    assert "hardware.yaml:6:5" in str(caught.value)
    assert "controller 'position_controller' has joints without a calibration: J63" in str(caught.value)


def test_a_pipe_needs_all_its_joints_calibrated(files, pipes, repository):
    lines = (repository / "config/support/hardware.yaml").read_text().splitlines(keepends=True)
    line = next(line for line in lines if "knee_pitch_3:" in line)

    def commanding_nothing(text):
        return text.replace("controller: direct", "controller: empty", 1)

    with pytest.raises(SolferError, match="lacks joints of the pipe 'link_side_online': knee_pitch_3"):
        pipes(files(line, "", main=commanding_nothing))


def test_pipes_between_plugins_are_not_calibrated(files, pipes):
    with pytest.raises(SolferError) as caught:
        pipes(
            files(
                "velocity_controller: {calibration: encoders}",
                "velocity_controller: {calibration: encoders, type: reference}",
            )
        )
    assert "the pipe 'velocity_controller' goes to other plugins" in str(caught.value)


def test_an_argument_overrides_the_system(repository):
    file = repository / "config/centauro.yaml"
    as_written, asked = load(file, "joint_states"), load(file, "joint_states", system="HW")
    assert (as_written.system, asked.system) == ("SM", "HW")
    assert as_written.calibrations == {} and "encoders" in asked.calibrations
    with pytest.raises(SolferError, match=r"centauro.yaml:13:11: mwoibn.system: expected 'HW' or 'SM', got 'HV'"):
        load(file, "joint_states", system="HV")
