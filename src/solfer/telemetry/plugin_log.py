"""What is recorded of a plugin: its pipes, its States, times and counts, and what its component declares."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from solfer.config.kinds.point import MESSAGES
from solfer.errors import ComponentError, SolferError, located
from solfer.interfaces.port import Port
from solfer.model.urdf.scalar_joints import BASE_DOFS
from solfer.pipes import CommandPipe, FeedbackPipe, StateFeedbackPipe
from solfer.pipes.contact.pipes import ContactFeedbackPipe
from solfer.pipes.sharing.cached_feedback import CachedFeedbackPipe
from solfer.plugins.cycle_timing import STAGES
from solfer.plugins.plugin import Plugin
from solfer.recording.kinds import JOINT_PARTS, NAMED, UNITS
from solfer.recording.log import Logger, LogSource, with_units
from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND
from solfer.robot import Robot
from solfer.transport.messages import BodyMessage, JointMessage, PointsMessage, VectorMessage, WrenchMessage

NANOSECOND = 1e-9
"""Unit of the times of stages [s]."""

_WRENCH = "geometry_msgs/WrenchStamped"


class PluginLog:
    """The live arrays of a plugin for a recording, as channels `<plugin>/<what>`.

    The measured State of its Robot is `measured/<field>`, and the commanded one beside it. `feedback/<pipe>/...` are
    the newest numbers of each pipe in with their age, `command/<pipe>/...` those of each pipe out as the receiver gets
    them, `timing` the stages of the cycle, `life` its state, how long commands blend in at least and the time that
    passed for the robot, `gate` how many values were held back, and `log/...` what the component declares.

    Args:
        plugin: The plugin, with all its pipes.

    Attributes:
        sources: The arrays.

    Raises:
        ComponentError: The component cannot declare what it logs.
    """

    def __init__(self, plugin: Plugin):
        self._plugin = plugin
        robot = plugin.robot
        log = Logger(plugin.name)
        # fields of a message of joints, and the interfaces of a State that they carry
        interfaces = {"position": "position", "velocity": "velocity", "effort": "torque"}
        for title, state in (("measured", robot.state), ("wanted", robot.command)):
            for field, interface in interfaces.items():
                _add_joints(log.section(title), robot, field, values=state[interface], names=robot.dofs)
        gates = [(pipe, gate) for pipe, gate in plugin.outputs.controllers if gate is not None]
        counted = [f"{pipe.name} {kind}" for pipe, gate in gates for kind in gate.kinds]
        # one piece of memory for all that is copied: each further one costs time in every cycle
        parts = np.cumsum([len(STAGES), len(plugin.feedbacks), len(counted)])
        times, ages, held, life = np.split(np.zeros(parts[-1] + 4), parts)
        self._ages = cast("memoryview[float]", memoryview(ages))
        self._aged = tuple(enumerate(plugin.feedbacks))
        self._copies: list[tuple[memoryview, memoryview]] = []
        for index, feedback in enumerate(plugin.feedbacks):
            self._add_feedback(log.section(f"feedback/{feedback.name}"), feedback, ages[index : index + 1])
        for command, _ in plugin.outputs.controllers:
            self._add_command(log, command)
        begin = 0
        for _, gate in gates:
            gate.count_in(memoryview(held).cast("B").cast("q")[begin : begin + len(gate.kinds)])
            begin += len(gate.kinds)
        if counted:
            log.add("gate", held.view(np.int64), counted)
        log.add("life", life, ("state", "blend", "passed", "lost"), ("", "s", "s", "s"))
        self._life = cast("memoryview[float]", memoryview(life))
        self._blend = plugin.outputs.blend
        log.add("load", plugin.overload.figures, ("left_out", "age", "pace"), ("", "s", ""))
        log.add("timing", times.view(np.int64), STAGES, "s", factor=NANOSECOND)
        self._words = memoryview(times).cast("B").cast("q")
        _declared(plugin, log.section("log"))
        self.sources: tuple[LogSource, ...] = tuple(log.sources)

    def take(self, now: float) -> None:
        """Bring the numbers up to date that no array keeps, at the time `now` [s] of the plugin's clock."""
        self._words[:] = self._plugin.timing.times
        life = self._life
        ages = self._ages
        life[0] = self._plugin.life
        life[1] = self._blend.shortest
        component = self._plugin.component
        life[2] = component.passed
        life[3] = component.time_lost
        for place, pipe in self._aged:
            ages[place] = now - pipe.arrival
        for target, source in self._copies:
            target[:] = source

    def _add_feedback(self, log: Logger, feedback: FeedbackPipe, age: np.ndarray) -> None:
        """Declare what a pipe has received last: numbers as the Robot has them, before a filter."""
        pipe = feedback.source.pipe if isinstance(feedback, CachedFeedbackPipe) else feedback
        robot = self._plugin.robot
        inputs = self._plugin.component.inputs
        if isinstance(pipe, StateFeedbackPipe):
            for each in pipe.state_fields:
                names = [robot.dofs[dof] for dof in each.dofs]
                _add_joints(log, robot, each.field, values=each.values, names=names)
        elif isinstance(pipe, ContactFeedbackPipe):
            for name, wrench in pipe.wrenches.items():
                log.add(name, wrench, frame=pipe.frame, kind=_WRENCH)
        elif feedback.name in inputs:
            _add_point(log, "value", inputs[feedback.name])
        log.add("age", age, ("age",), "s")

    def _add_command(self, log: Logger, pipe: CommandPipe) -> None:
        """Declare what a pipe sends."""
        name = f"command/{pipe.name}"
        sent = pipe.sent
        port = self._plugin.component.outputs.get(pipe.name)
        if isinstance(sent, JointMessage):
            for field in (*JOINT_PARTS, "stiffness", "damping", *sent.interfaces):
                if (values := sent.numbers(field)) is not None:
                    _add_joints(log.section(name), self._plugin.robot, field, values=values, names=sent.names)
        elif isinstance(sent, BodyMessage):
            parts = (sent.position, sent.orientation, sent.linear, sent.angular)
            self._add_copies(log, name, "nav_msgs/Odometry", parts=parts, frame=sent.frame, child=sent.child)
        elif isinstance(sent, WrenchMessage):
            self._add_copies(log, name, _WRENCH, parts=(sent.force, sent.torque), frame=sent.frame)
        elif isinstance(sent, PointsMessage) and pipe.quantity == "wrench" and sent.names:
            for contact, wrench in zip(sent.names, sent.values, strict=True):
                log.add(f"{name}/{contact}", wrench, frame=sent.frame, kind=_WRENCH)
        elif isinstance(sent, PointsMessage):
            log.add(name, sent.values, _of_each(sent.names, sent.values), frame=sent.frame)
        elif isinstance(sent, VectorMessage) and port is not None:
            _add_point(log, name, port, frame=sent.frame)

    def _add_copies(
        self, log: Logger, name: str, kind: str, parts: Sequence[np.ndarray], frame: str, *, child: str = ""
    ) -> None:
        """Declare numbers that are in several arrays, one after the other."""
        whole = np.zeros(sum(part.size for part in parts))
        start = 0
        for part in parts:
            self._copies.append((memoryview(whole[start : start + part.size]), memoryview(part)))
            start += part.size
        log.add(name, whole, frame=frame, kind=kind, child=child)


def _declared(plugin: Plugin, log: Logger) -> None:
    """Let the component declare what it logs.

    Raises:
        ComponentError: It cannot.
    """
    try:
        plugin.start_log(log)
    except SolferError as error:
        raise error.at(f"start_log of '{plugin.name}'") from None
    except Exception as error:
        raise ComponentError(
            f"the component of '{plugin.name}' cannot declare what it logs: {located(error)}",
            expected="a `start_log` that calls `logger.add`",
        ) from error


def _add_joints(log: Logger, robot: Robot, field: str, values: np.ndarray, names: Sequence[str]) -> None:
    """Declare a field of joints, in rad, or m of a joint that slides."""
    forms = {
        "position": "{}",
        "velocity": "{}/s",
        "acceleration": "{}/s2",
        "effort": "Nm",
        "torque": "Nm",
        "stiffness": "Nm/{}",
        "damping": "Nms/{}",
    }
    form = forms.get(field, "")
    units = []
    for name in names:
        joint = robot.description.joints.get(name)  # one that the Robot does not have counts as turning
        slides = name in BASE_DOFS[:3] if joint is None else joint.type == "prismatic"
        units.append(form.replace("Nm", "N").format("m") if slides else form.format("rad"))
    log.add(field, values, names, units, kind=JOINTS_KIND if field in JOINT_PARTS else COLUMNS_KIND)


def _add_point(log: Logger, name: str, port: Port, frame: str = "") -> None:
    """Declare the numbers of a port."""
    kind = MESSAGES[port.quantity]
    # of the quantities whose message does not contain them
    units = {"velocity": "m/s", "acceleration": "m/s2", "force": "N", "torque": "Nm"}
    unit = units.get(port.quantity, "")
    if port.count is None:
        log.add(name, port.value, unit=unit, frame=frame, kind=kind)
    else:
        columns = NAMED[kind]
        names = [f"{index} {column}" for index in range(port.count) for column in columns]
        of_columns = (unit,) * len(columns) if unit else with_units(columns, UNITS)
        log.add(name, port.value, names, unit=of_columns * port.count, frame=frame)


def _of_each(names: tuple[str, ...], values: np.ndarray) -> list[str]:
    """Name the numbers of several Points."""
    count, width = values.shape
    titles = names if len(names) == count else tuple(str(index) for index in range(count))
    return [f"{title} {column}" if width > 1 else title for title in titles for column in range(width)]
