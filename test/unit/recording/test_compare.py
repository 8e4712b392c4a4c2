"""Comparison of recordings: planted differences of a real motion are found, and noise is not mistaken for one."""

import dataclasses
import re
from contextlib import closing

import numpy as np
import pytest
from support.integration.world import STEP, World

from solfer.errors import RecordingError, UnknownName
from solfer.recording.model import JOINTS_KIND, Channel, Recording
from solfer.recording.writer import save
from solfer_tools.cli.main import main
from solfer_tools.review import Difference, compare

POSITION = "joint_states/feedback/link_side_online/position"
PARTS = ("arm", "neck", "torso_yaw", "hip_pitch")
BASE = 6  # DoFs
NOISE = 3e-4  # [rad]
SEEDS = range(10)
LATE = 4  # [ms]
KINDS = (Difference.SIGN, Difference.SWAPPED, Difference.DELAY, Difference.GAIN)


class Motion:
    """CENTAURO's joints, each of which moves in its own way.

    Attributes:
        joints: Their names.
        moved: Names of those that were asked to move, all but the legs.
        positions: Where they were in each millisecond, shape (T, joints) [rad].
    """

    def __init__(self):
        with closing(World()) as world:
            self._run(world)

    def _run(self, world):
        plugin, rng = world.plugin("joint_states"), np.random.default_rng(0)
        robot = plugin.robot
        world.run(0.5)
        rows = []
        world.bus.every(STEP, lambda: rows.append(world.simulation.q.copy()))
        chosen = [name for name in robot.dofs if any(part in name for part in PARTS)]
        dofs = [robot.dof(name) for name in chosen]
        share = np.array([0.05 if "hip" in name else 0.25 for name in chosen])
        start = robot.state.position[dofs].copy()
        lower, upper = robot.lower_limits.position[dofs] + 0.01, robot.upper_limits.position[dofs] - 0.01
        for _ in range(6):
            goal = np.clip(start + share * rng.uniform(-1.0, 1.0, len(dofs)), lower, upper)
            assert world.ask(joints=tuple(chosen), positions=tuple(goal), speed=1.0).success
            world.run(rng.uniform(0.3, 0.6))
        self.joints = tuple(robot.dofs[BASE:])
        self.moved = [name for name in chosen if "hip" not in name]
        self.positions = np.array(rows)[:, BASE:]

    def recording(self, positions=None, rate=200.0, start=0.0, clock=0.0, noise=0.0, seed=0):
        """Return what sensors of a rate [Hz] and a noise [rad] record from `start` [s] on, by their own clock."""
        positions = self.positions if positions is None else positions
        rows = positions[round(start / STEP) :: round(1.0 / rate / STEP)]
        times = clock + np.arange(len(rows)) / rate
        values = rows + noise * np.random.default_rng(seed).standard_normal(rows.shape)
        units = ("rad",) * len(self.joints)
        return Recording({POSITION: Channel(POSITION, JOINTS_KIND, self.joints, units, "", times, values)})


@pytest.fixture(scope="module")
def motion():
    """Simulate once."""
    return Motion()


@pytest.fixture(scope="module")
def simulated(motion):
    return motion.recording(noise=NOISE, seed=1000, clock=100.0)


def late(column, milliseconds):
    return np.concatenate([np.full(milliseconds, column[0]), column[:-milliseconds]])


def hardware(motion, positions, seed, noise=NOISE):
    """Record at another rate, from another time on, by another clock."""
    return motion.recording(positions, rate=250.0, start=0.151, clock=7.0 + seed, noise=noise, seed=2000 + seed)


def planted(motion, seed):
    """Plant one difference of each kind; returns the positions, and what has to be found."""
    drawn = np.random.default_rng(seed).permutation(len(motion.moved))
    names = [motion.moved[place] for place in drawn[:4]]
    neighbour = next(name for name in motion.moved[drawn[1] + 1 :] + motion.moved if name not in names)
    sign, swap, delay, gain = (motion.joints.index(name) for name in names)
    other = motion.joints.index(neighbour)
    positions = motion.positions.copy()
    positions[:, sign] *= -1.0
    positions[:, [swap, other]] = positions[:, [other, swap]]
    positions[:, delay] = late(positions[:, delay], LATE)
    positions[:, gain] *= 1.1
    return positions, dict(zip(names, KINDS, strict=True)) | {neighbour: Difference.SWAPPED}


def found(comparison):
    return {verdict.joint: verdict.differences for verdict in comparison.different}


def named(comparison, joint):
    return next(verdict for verdict in comparison.verdicts if verdict.joint == joint)


@pytest.mark.daily(4)
@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_planted_differences_are_found_and_no_others(motion, simulated, seed):
    positions, expected = planted(motion, seed)
    comparison = compare(simulated, hardware(motion, positions, seed))
    assert found(comparison) == {joint: (kind,) for joint, kind in expected.items()}
    for joint, kind in expected.items():
        law = named(comparison, joint).law
        if kind is Difference.DELAY:
            assert law[2] == pytest.approx(1e-3 * LATE, abs=1.5e-3)
        elif kind is Difference.GAIN:
            assert law[0] == pytest.approx(1.1, abs=0.01)


@pytest.mark.parametrize("seed", SEEDS)
def test_noise_alone_is_no_difference(motion, seed):
    noise = (NOISE, 1e-3)[seed % 2]
    first = motion.recording(noise=noise, seed=seed)
    comparison = compare(first, hardware(motion, None, seed, noise))
    assert found(comparison) == {}
    assert comparison.shift == pytest.approx(7.0 + seed - 0.151, abs=1e-3)


def test_a_common_delay_is_the_alignment(motion, simulated):
    positions = np.apply_along_axis(late, 0, motion.positions, 30)
    comparison = compare(simulated, hardware(motion, positions, 0))
    assert found(comparison) == {}
    assert comparison.shift == pytest.approx(7.0 - 100.0 - 0.151 + 0.030, abs=1e-3)


def test_the_joint_that_differs_first_is_named(motion, simulated):
    """One joint sticks from half a second on, another one from two seconds on."""
    positions = motion.positions.copy()
    for joint, moment in (("j_arm1_3", 2000), ("neck_yaw", 500)):
        column = motion.joints.index(joint)
        positions[moment:, column] += 0.1
    comparison = compare(simulated, hardware(motion, positions, 0))
    assert [verdict.joint for verdict in comparison.different] == ["neck_yaw", "j_arm1_3"]
    assert [verdict.since for verdict in comparison.different] == pytest.approx([0.5, 2.0], abs=0.04)


def test_still_missing_and_shifted_joints_are_distinguished(motion, simulated):
    """Four planted faults at four joints: each gets its own kind of difference, and no other joint gets one."""
    positions = motion.positions.copy()
    still, offset, wheel = (motion.joints.index(name) for name in ("j_arm2_4", "torso_yaw", "j_wheel_1"))
    positions[:, still] = positions[0, still]
    positions[:, offset] += 0.05
    positions[:, wheel] += np.linspace(0.0, 1.0, len(positions))
    second = hardware(motion, positions, 0).channels[POSITION]
    second = dataclasses.replace(
        second, columns=second.columns[:-1], units=second.units[:-1], values=second.values[:, :-1]
    )
    comparison = compare(simulated, Recording({POSITION: second}))
    assert found(comparison) == {
        "j_arm2_4": (Difference.NOT_MOVED,),
        "torso_yaw": (Difference.OFFSET,),
        "j_wheel_1": (Difference.MOVED_ALONE,),
        motion.joints[-1]: (Difference.MISSING,),
    }
    assert named(comparison, "torso_yaw").law[1] == pytest.approx(0.05, abs=2e-3)
    assert "j_wheel_2" in comparison.hardly_moving and "j_arm1_1" not in comparison.hardly_moving


def test_an_outlier_or_two_change_nothing(motion, simulated):
    recording = hardware(motion, None, 0)
    recording.channels[POSITION].values[100::150] += 0.5
    assert found(compare(simulated, recording)) == {}


def test_the_age_of_a_message_counts(motion, simulated):
    """Rows of a faster cycle repeat what was received last; its age is the time since then."""
    channel = motion.recording(noise=NOISE, seed=5).channels[POSITION]
    times = np.arange(0.0, channel.times[-1], 0.002)
    row = np.searchsorted(channel.times, times + 1e-9) - 1
    name = POSITION.replace("/position", "/age")
    held = dataclasses.replace(channel, times=times, values=channel.values[row])
    age = Channel(name, "solfer_msgs/Columns", ("age",), ("s",), "", times, (times - channel.times[row])[:, None])
    comparison = compare(simulated, Recording({POSITION: held, name: age}))
    assert found(comparison) == {}
    assert comparison.shift == pytest.approx(-100.0, abs=5e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda channel: {"values": np.zeros_like(channel.values)}, "no joint moves in both recordings"),
        (lambda channel: {"times": channel.times[:99], "values": channel.values[:99]}, "too short to be compared"),
        (lambda channel: {"name": "joint_states/timing"}, "no positions of joints were recorded"),
        (lambda channel: {"columns": tuple(f"{name}x" for name in channel.columns)}, "no joint is in both"),
    ],
)
def test_what_cannot_be_compared_is_said(motion, simulated, change, message):
    channel = simulated.channels[POSITION]
    other = dataclasses.replace(channel, **change(channel))
    with pytest.raises(RecordingError, match=message):
        compare(simulated, Recording({other.name: other}))


def test_an_unknown_plugin_is_named(simulated):
    with pytest.raises(UnknownName, match="unknown plugin 'joint_stats'") as caught:
        compare(simulated, simulated, plugins=["joint_stats"])
    assert caught.value.names == ("joint_states",)


@pytest.mark.slow
def test_the_command_prints_and_draws(motion, simulated, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    positions, expected = planted(motion, 3)
    save(simulated, tmp_path / "sim.mcap")
    save(hardware(motion, positions, 3), tmp_path / "robot.mcap")
    assert main(["compare", "sim.mcap", "robot.mcap", "--limits", "--plot", "out.png"]) == 1
    text = capsys.readouterr().out
    assert all(joint in text for joint in expected) and "wrong sign" in text and "late by" in text
    assert re.search(r"neck_yaw +0\.\d{3} +0\.\d{4} +\d+\.\d\n", text)
    assert (tmp_path / "out.png").read_bytes()[1:4] == b"PNG"
    assert main(["compare", "sim.mcap", "sim.mcap"]) == 0
    assert "no joint differs" in capsys.readouterr().out
    assert main(["compare", "sim.mcap", "robot.mcap", "--plot", "out.gif"]) == 2
    assert "out.gif: pictures of the kind '.gif'" in capsys.readouterr().err
