"""Fig. 5 of the paper, one of whose processes is killed or stopped: the robot comes to rest, and its course goes on."""

import random
import re
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from support.processes import until

from breaking.bounds import Verdict
from breaking.figures import describe_robot, layer_file, plugin, unique
from breaking.processes import REPOSITORY
from breaking.record import Samples
from breaking.systems import RosSystem, System, XbotSystem

COURSE = REPOSITORY / "config" / "figures" / "course.yaml"
NAVIGATION = ("nodes/navigation", "play", str(COURSE), "--target", "locomotion", "--positions")
PLUGINS = ("hands", "odometry", "ground_forces", "locomotion", "full_compensation")
WHEEL, STEERING = "j_wheel_", "ankle_yaw_"

LATEST = 25.0
"""Latest moment of the course at which a process is killed [s]."""

AFTER = 3.0
"""Time in which the robot is watched [s]."""

LEASE, SPARE = 0.3, 0.3
"""Time of a claim without commands, and time to brake [s]."""

SILENCE, BRAKING = 0.55, 0.9
"""Time without velocities after which locomotion brakes, and how long that takes [s]."""

BEGINNING = 0.3
"""Time in which a new robot has to stand [s]."""

AT_REST, DRIVES = 0.1, 0.5
"""Speeds of wheels [rad/s]."""

AWAY = 0.05
"""How far a joint may go on that nobody moves any more [rad]."""

STOP = 0.05
"""Time in which a joint stops beyond that: those that steer turn at up to 4 rad/s [s]."""

NAMED = {
    "navigation": r"no position|locomotion/base",
    "hands": r"upper_body|hands",
    "full_control": r"full_control|full_compensation|locomotion/pace",
    "xbot": r"full_compensation|process \d+ has ended|locomotion/pace",
    "bridge": r"no position|locomotion/pace",
    "simulator": r"joint_states|link_side_online|odometry",
}
"""How the logs of survivors name what was killed."""

STEERED = ("navigation", "bridge")
"""Without these locomotion brakes by itself; meanwhile legs and wheels steer."""


COMMANDS = "position_controller/command"
"""Topic of the commands of the joints."""


class RosCourse(RosSystem):
    """Nodes, and the newest commands that they send.

    Attributes:
        commanded: Commanded positions, by joint [rad].
    """

    def __init__(self, *given):
        import rospy

        from solfer.msg import JointCommand

        super().__init__(*given)
        self.commanded: dict[str, float] = {}
        self._commands = rospy.Subscriber(
            f"/{COMMANDS}", JointCommand, self._receive_command, queue_size=1, tcp_nodelay=True
        )

    def _receive_command(self, message) -> None:
        self.commanded = dict(zip(message.name, message.position, strict=True))

    def close(self) -> None:
        """See `System.close`."""
        self._commands.unregister()
        super().close()


class XbotCourse(XbotSystem):
    """A layer, and the newest commands that it sends."""

    def __init__(self, *given):
        super().__init__(*given)
        self._commands = self._node.reader(COMMANDS, "solfer/JointCommand")

    @property
    def commanded(self) -> dict[str, float]:
        """Commanded positions, by joint [rad]."""
        self._commands.read()
        message = self._commands.message
        return {} if message is None else dict(zip(message.names, message.position.tolist(), strict=True))


def ros_figure_5(folder: Path) -> System:
    """Make the nodes of launch/figure_5.launch, and a navigation."""
    commands = {"simulator": ("nodes/simulator",), "hands": plugin("hands"), "navigation": NAVIGATION}
    shared = ("nodes/shared", "-c", str(REPOSITORY / "config" / "centauro.yaml"), "-n", "full_control")
    return RosCourse(commands | {"full_control": shared}, folder, {}, "full_control")


def rt_figure_5(folder: Path) -> System:
    """Make the layer of config/figures/figure_5.yaml, its bridge, and a navigation in ROS."""
    name = unique()
    file = layer_file(folder, ("inverse_kinematics::hands", "full_control"), ("hands", "full_control"))
    place = ("--namespace", name)
    commands = {
        "simulator": ("nodes/xbot_simulator", *place),
        "xbot": ("nodes/xbot", str(file), *place),
        "bridge": ("nodes/xbot_bridge", str(file), *place),
        "navigation": NAVIGATION,
    }
    describe_robot()
    return XbotCourse(commands, name, folder, PLUGINS, {}, "xbot")


@dataclass(frozen=True)
class Kill:
    """A process is killed some time after the robot has begun to drive [s], or stopped for a while [s]."""

    victim: str
    moment: float
    stop: float = 0.0

    @property
    def kind(self) -> str:
        """What it is called."""
        return "stop" if self.stop else "kill"

    def __str__(self) -> str:
        return f"{self.kind} {self.victim} after {self.moment:.1f} s"


@dataclass(frozen=True)
class KillPlan:
    """A trial."""

    faults: tuple[Kill, ...]


def draw_kill(seed: int, victims: tuple[str, ...], stop: float = 0.0) -> KillPlan:
    """Draw the moment; seeds take the victims in turn, and equal seeds make equal plans."""
    moment = random.Random(f"course {seed}").uniform(0.0, LATEST)
    return KillPlan((Kill(victims[seed % len(victims)], moment, stop),))


class CourseTrial:
    """Carries a plan out.

    Args:
        system: Drives along the course, or is to begin with it.
        plan: What happens.
    """

    def __init__(self, system: System, plan: KillPlan):
        self._system, self.plan, self._kill = system, plan, plan.faults[0]

    def run(self) -> Verdict:
        """Carry it out; returns what the robot did."""
        verdict = Verdict()
        try:
            self._run(verdict)
        except AssertionError as error:
            verdict.findings.append(str(error))
        ours = [each for each in self._system.processes.errors() if not each.startswith("navigation ended")]
        verdict.findings += ours
        return verdict

    def _run(self, verdict: Verdict) -> None:
        system, record, victim = self._system, self._system.record, self._kill.victim
        self._drive("a robot that drives")
        system.passes(self._kill.moment)
        self._drive("a robot that drives")
        record.forget()
        robot, moment, lengths = record.robots, record.time, self._lengths()
        (system.processes.stop if self._kill.stop else system.processes.kill)(victim)
        commanded = system.commanded
        if self._kill.stop:
            if victim == system.simulator:
                time.sleep(self._kill.stop)
            else:
                system.passes(self._kill.stop)
                self._check(verdict, record.samples(robot), moment, commanded)
            system.processes.go_on(victim)
            system.passes(1.0)
        elif victim == system.simulator:
            system.replace_robot()
            system.passes(1.0)
            self._check_new(verdict, record.samples(record.robots))
        else:
            system.passes(AFTER)
            self._check(verdict, record.samples(robot), moment, commanded)
            system.processes.start(victim)
        self._drive(f"a robot that drives on after a new {victim}")
        if self._kill.stop:
            return
        news = {name: text for name, text in self._news(lengths).items() if name != victim}
        if not any(re.search(NAMED[victim], text) for text in news.values()):
            verdict.findings.append(f"no survivor logs that {victim} is gone")

    def _drive(self, what: str) -> None:
        """Wait until wheels turn; a navigation at its end begins again."""
        record = self._system.record

        def drives() -> bool:
            if self._system.processes.over("navigation"):
                self._system.processes.start("navigation")
            return self._fastest() > DRIVES

        until(lambda: bool(record) and drives(), what)

    def _fastest(self) -> float:
        record = self._system.record
        return max(abs(record.velocity(joint)) for joint in record.joints if joint.startswith(WHEEL))

    def _check(self, verdict: Verdict, samples: Samples, moment: float, commanded: dict[str, float]) -> None:
        """Check wheels and joints after a kill; joints stay between their places and all commands."""
        joints, victim = self._system.record.joints, self._kill.victim
        wheels = np.array([joint.startswith(WHEEL) for joint in joints])
        limit = SILENCE + BRAKING + SPARE if victim in STEERED else LEASE + SPARE
        speeds = np.abs(samples.velocities[:, wheels]).max(axis=1)
        turning = samples.times[speeds > AT_REST]
        last = float(turning[-1] - moment) if len(turning) else 0.0
        verdict.wheel = max(verdict.wheel, last)
        if last > limit:
            late = float(speeds[samples.times > moment + limit].max())
            verdict.findings.append(
                f"wheels turned until {last:.2f} s after the kill, {limit:.2f} s are allowed; at {late:.2f} rad/s then"
            )
        if victim in STEERED:
            return
        before = samples.positions[np.searchsorted(samples.times, moment, side="right") - 1]
        places = [before]
        for commands in (commanded, self._system.commanded):
            places.append([commands.get(joint, place) for joint, place in zip(joints, before, strict=True)])
        low, high = np.min(places, axis=0), np.max(places, axis=0)
        beyond = np.maximum(low - samples.positions, samples.positions - high)
        stopping = STOP * np.abs(samples.velocities).max(axis=0)
        away = np.where(wheels, 0.0, np.maximum(beyond - stopping, 0.0)).max(axis=0)
        verdict.away = max(verdict.away, float(away.max()))
        if away.max() > AWAY:
            verdict.findings.append(f"{joints[int(away.argmax())]} went {away.max():.3f} rad beyond its reference")

    def _check_new(self, verdict: Verdict, samples: Samples) -> None:
        """Check a robot that begins anew: commands blend in from where it stands; wheels are steered for the course."""
        first = samples.times <= samples.times[0] + BEGINNING
        samples = Samples(*(each[first] for each in samples))
        wheels = np.array([joint.startswith((WHEEL, STEERING)) for joint in self._system.record.joints])
        away = np.where(wheels, 0.0, np.abs(samples.positions - samples.positions[0])).max(axis=0)
        speed = float(np.abs(samples.velocities[:, ~wheels]).max())
        verdict.speed = max(verdict.speed, speed)
        if away.max() > AWAY or speed > 2.0:
            joint = self._system.record.joints[int(away.argmax())]
            verdict.findings.append(f"{joint} jumped by {away.max():.3f} rad at a start, {speed:.2f} rad/s at most")

    def _lengths(self) -> dict[str, int]:
        processes = self._system.processes
        return {name: processes.log(name).stat().st_size for name in processes.names if processes.log(name).exists()}

    def _news(self, lengths: dict[str, int]) -> dict[str, str]:
        processes = self._system.processes
        texts = {name: processes.log(name).read_bytes()[size:] for name, size in lengths.items()}
        return {name: text.decode(errors="replace") for name, text in texts.items()}
