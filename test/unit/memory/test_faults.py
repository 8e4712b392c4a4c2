"""Faults of a transport: each one does what it is described to do, and one seed gives one run."""

from pathlib import Path

import numpy as np
import pytest
from support.plugins.fleet import Fleet, still, tree

from solfer.errors import SolferError, SolferErrors, UnknownName
from solfer.middleware.memory import Bus, FaultsRecord, MemoryMiddleware, read_faults
from solfer.transport import JointMessage, MessageStatus

LOST = {"quiet": 0, "busy": 12, "bad": 40}
"""Messages of 400 that do not arrive."""

PROFILES = Path(__file__).resolve().parents[3] / "config/transport"
JOINT_STATE, TOPIC = "sensor_msgs/JointState", "joint_states"
COUNT = 4000


def run(count=COUNT, period=0.01, seed=1, topic=TOPIC, pattern=TOPIC, **faults):
    """Publish numbered messages; return number, delay [s] and stamp less time of sending [s] of those that arrive.

    The numbers are in the order of their arrival, shape (n, 3).
    """
    bus = Bus(faults=FaultsRecord(seed=seed, topics={pattern: faults} if faults else {}))
    writer = MemoryMiddleware(bus, "robot").writer(topic, JOINT_STATE)
    sent, arrived = [], []

    def publish():
        sent.append(bus.time)
        writer.write(JointMessage(("a",), position=np.array([len(sent) - 1.0]), stamp=bus.time))

    def arrive(message):
        number = int(message.position[0])
        arrived.append((number, bus.time - sent[number], message.stamp - sent[number]))

    bus.topic(topic, JOINT_STATE).listeners.append(arrive)
    bus.every(period, publish)
    bus.run_until((count - 0.5) * period)
    assert len(sent) == count
    bus._agenda.clear()
    bus.run_until(bus.time + 10.0)
    return np.array(arrived)


def test_without_faults_messages_are_there_at_once():
    arrived = run()
    assert (arrived[:, 0] == np.arange(COUNT)).all() and not arrived[:, 1:].any()


def test_a_delay_is_that_of_every_message():
    arrived = run(delay=0.0137)
    assert (arrived[:, 0] == np.arange(COUNT)).all()
    assert arrived[:, 1] == pytest.approx(0.0137, abs=1e-9)


def test_jitter_is_uniform_from_the_delay_on():
    delays = run(delay=0.002, jitter=0.006)[:, 1] - 0.002  # shorter than the period: none waits for another
    assert len(delays) == COUNT and delays.min() >= -1e-9 and delays.max() <= 0.006 + 1e-9
    assert np.histogram(delays, 10, (0.0, 0.006))[0] == pytest.approx(COUNT / 10, abs=5 * np.sqrt(COUNT * 0.09))


def test_a_share_is_lost():
    arrived = run(loss=0.1)
    assert len(arrived) == pytest.approx(0.9 * COUNT, abs=5 * np.sqrt(COUNT * 0.09))
    assert not arrived[:, 1].any() and (np.diff(arrived[:, 0]) > 0).all()
    assert len(run(loss=1.0)) == 0


def test_bunches_arrive_together():
    arrived = run(period=0.002, bunch=0.02)
    times = 0.002 * arrived[:, 0] + arrived[:, 1]
    assert times == pytest.approx(0.02 * np.round(times / 0.02), abs=1e-9)
    assert arrived[:, 1].min() >= -1e-9 and arrived[:, 1].max() < 0.02
    assert (arrived[:, 0] == np.arange(COUNT)).all()
    assert (np.unique(np.round(times / 0.02), return_counts=True)[1][1:-1] == 10).all()


@pytest.mark.parametrize("reorder", [False, True])
def test_messages_overtake_each_other_only_where_they_may(reorder):
    arrived = run(period=0.002, jitter=0.04, reorder=reorder)
    assert len(arrived) == COUNT and arrived[:, 1].max() <= 0.04 + 1e-9
    overtaken = (np.diff(arrived[:, 0]) < 0).mean()
    assert overtaken > 0.3 if reorder else overtaken == 0


def test_stamps_are_those_of_another_clock():
    arrived = run(clock=-0.25)
    assert arrived[:, 2] == pytest.approx(-0.25) and not arrived[:, 1].any()


FAULTS = {"delay": 0.001, "jitter": 0.03, "loss": 0.2, "bunch": 0.004, "clock": 0.1}


def test_one_seed_gives_one_run():
    first, again, other = run(**FAULTS), run(**FAULTS), run(seed=2, **FAULTS)
    assert first.tobytes() == again.tobytes() != other.tobytes()


def test_topics_are_drawn_for_by_themselves():
    assert run(**FAULTS).tobytes() != run(topic="imu", pattern="*", **FAULTS).tobytes()
    assert run(**FAULTS).tobytes() == run(pattern="joint_*", **FAULTS).tobytes()
    assert run(**FAULTS).tobytes() == run(topic="/joint_states", pattern="/*", **FAULTS).tobytes()


def test_other_faults_lose_the_same_messages():
    assert (run(loss=0.2)[:, 0] == run(loss=0.2, jitter=0.004)[:, 0]).all()


def test_other_topics_have_no_faults():
    assert not run(topic="imu", delay=1.0)[:, 1].any()


def test_the_first_pattern_that_fits_counts():
    faults = FaultsRecord.model_validate({"topics": {"joint_*": {"delay": 0.1}, "*": {"delay": 0.2}}})
    assert faults.of_topic("/joint_states").delay == 0.1 and faults.of_topic("imu").delay == 0.2


@pytest.mark.parametrize("kept", [0, 8])
def test_readers_know_when_a_message_has_arrived(kept):
    """What is due at the time of a cycle is there in it, and its age counts from then on."""
    bus = Bus(faults=FaultsRecord.model_validate({"topics": {TOPIC: {"delay": 0.03}}}))
    node = MemoryMiddleware(bus)
    reader, writer, read = node.reader(TOPIC, JOINT_STATE, kept), node.writer(TOPIC, JOINT_STATE), []

    def cycle():
        if (reader.read_next() is not None) if kept else (reader.read() is MessageStatus.NEW):
            read.append((round(bus.time, 9), round(reader.arrival, 9), round(reader.message.position[0], 9)))

    bus.every(0.01, cycle, 0.0)
    bus.every(0.01, lambda: writer.write(JointMessage(("a",), position=np.array([bus.time]))), 0.0)
    bus.run_until(0.995)
    assert len(read) == 97
    for time, arrival, sent in read:
        assert time == pytest.approx(arrival, abs=1e-8) and arrival == pytest.approx(sent + 0.03, abs=1e-8)


@pytest.mark.parametrize("share", [0.0, 0.2])
def test_a_share_of_the_cycles_is_left_out(share):
    runs = []
    for seed in (1, 1, 2):
        bus, cycles, work = Bus(faults=FaultsRecord.model_validate({"seed": seed, "loop": {"skip": share}})), [], []
        bus.every(0.01, lambda bus=bus, cycles=cycles: cycles.append(bus.time), cycles=True)
        bus.every(0.01, lambda bus=bus, work=work: work.append(bus.time))
        bus.run_until(0.01 * (COUNT - 0.5))
        assert len(work) == COUNT and set(cycles) <= set(work)
        assert len(cycles) == pytest.approx((1.0 - share) * COUNT, abs=5 * np.sqrt(COUNT * share))
        runs.append(cycles)
    assert runs[0] == runs[1] and (runs[0] != runs[2]) == bool(share)


def test_loops_are_drawn_for_by_themselves():
    bus, cycles = Bus(faults=FaultsRecord.model_validate({"loop": {"skip": 0.5}})), ([], [])
    for each in cycles:
        bus.every(0.01, lambda each=each: each.append(bus.time), cycles=True)
    bus.run_until(1.0)
    assert cycles[0] != cycles[1]


def test_the_shipped_profiles():
    profiles = {path.stem: read_faults(path) for path in PROFILES.glob("*.yaml")}
    assert set(profiles) == {"quiet", "busy", "bad"}
    quiet, busy, bad = (profiles[name].topics["*"] for name in ("quiet", "busy", "bad"))
    assert (quiet.jitter, quiet.loss, profiles["quiet"].loop.skip) == (0.001, 0.0, 0.0)
    assert (busy.jitter, busy.loss, profiles["busy"].loop.skip) == (0.015, 0.03, 0.1)
    assert (bad.jitter, bad.loss, bad.bunch, bad.clock, profiles["bad"].loop.skip) == (0.04, 0.1, 0.02, 0.005, 0.2)


@pytest.mark.parametrize(
    ("text", "place", "error"),
    [
        ("topics:\n  imu: {jiter: 0.1}\n", "2:9", "jitter"),
        ("topics:\n  imu: {loss: 1.5}\n", "2:15", "at most 1"),
        ("topics:\n  imu: {delay: -0.1}\n", "2:16", "at least 0"),
        ("topics:\n  imu: {reorder: 1}\n", "2:18", "true or false"),
        ("topics: [imu]\n", "1:9", "map"),
        ("loop: {skip: .nan}\n", "1:14", "finite"),
        ("sed: 3\n", "1:1", "seed"),
    ],
)
def test_a_mistake_has_its_place(tmp_path, text, place, error):
    file = tmp_path / "faults.yaml"
    file.write_text(text)
    with pytest.raises(SolferError) as caught:
        read_faults(file)
    assert f"faults.yaml:{place}" in str(caught.value) and error in str(caught.value)


def test_a_topic_that_nobody_uses_is_a_mistake(tmp_path):
    file = tmp_path / "faults.yaml"
    file.write_text("topics:\n  joint_state: {delay: 0.1}\n  '*': {}\n")
    bus = Bus(faults=read_faults(file))
    MemoryMiddleware(bus).writer("/joint_states", JOINT_STATE)
    with pytest.raises(UnknownName, match="faults.yaml:2") as caught:
        bus.check_faults()
    assert caught.value.names[0] == "joint_states"
    bus.topic("joint_state", JOINT_STATE)
    bus.check_faults()
    with pytest.raises(SolferErrors):
        Bus(faults=read_faults(file)).check_faults()


@pytest.mark.parametrize("profile", ["quiet", "busy", "bad"])
def test_plugins_on_a_transport_with_faults_repeat_to_the_bit(tmp_path, profile):
    """Faults are drawn by their seed alone, or runs with faults could not be compared."""
    changed = tree()
    changed["feedback"]["joints"]["history"] = 32

    def seen():
        fleet = Fleet(tmp_path, changed, ("first", "second"), faults=read_faults(PROFILES / f"{profile}.yaml"))
        fleet.bus.check_faults()
        generator, rows = np.random.default_rng(3), []
        (history,) = fleet.plugins[0].robot.state.histories
        for _ in range(400):
            fleet.cycle(**still(*generator.uniform(-0.04, 0.04, 2)))
            rows.append(history.arrivals[: history.count].tobytes() + history.values[: history.count].tobytes())
        return rows, [plugin.robot.state.position.tobytes() for plugin in fleet.plugins], fleet.plugins[0].feedbacks[0]

    (first, states, pipe), (again, same, _) = seen(), seen()
    assert first == again and states == same and pipe.dropped == 0
    numbers = 1 + 2 * 2  # its arrival, position and velocity of two joints
    assert 400 - sum(map(len, first)) / (8 * numbers) == pytest.approx(LOST[profile], abs=20)
