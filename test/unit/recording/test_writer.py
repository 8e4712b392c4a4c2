"""The file of a recording: what is written is read back to the bit, by our reader and by others."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pybag.mcap_reader import McapFileReader
from rosbags.highlevel import AnyReader

from solfer.errors import RecordingError, UnknownName
from solfer.recording.kinds import JOINT_PARTS, NAMED, UNITS
from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND, Channel, Event, Recording
from solfer.recording.reader import read
from solfer.recording.writer import RecordingWriter, save

JOINT_NAMES = ("shoulder", "elbow_ü", "")
STRANGE = (np.nan, np.inf, -0.0, 5e-324, 1.7976931348623157e308, 1 / 3)
WRENCH, ODOMETRY = "geometry_msgs/WrenchStamped", "nav_msgs/Odometry"


def channel(name, kind, columns, times, frame="", child=""):
    """Make numbers of all kinds, among them those that do not survive a detour over text or float32."""
    values = np.random.default_rng(len(name)).standard_normal((len(times), len(columns)))
    values.flat[: len(STRANGE)] = STRANGE[: values.size]
    units = tuple(UNITS.get(column, "") for column in columns)
    return Channel(name, kind, tuple(columns), units, frame, times, values, child)


@pytest.fixture
def recording():
    """Channels of every kind at two rates."""
    fast, slow = 100.0 + 1e-3 * np.arange(700), 100.5 + 0.25 * np.arange(3)
    joints = [channel(f"arm/feedback/link/{part}", JOINTS_KIND, JOINT_NAMES, fast) for part in ("velocity", "position")]
    shaped = [channel(f"arm/{kind}", kind, columns, slow, "world") for kind, columns in NAMED.items()]
    odometry = channel("arm/base", ODOMETRY, NAMED[ODOMETRY], fast, "world", "pelvis")
    others = [
        channel("arm/log/error", COLUMNS_KIND, ("one", "two"), fast, "tool"),
        channel("arm/log/nothing", COLUMNS_KIND, (), fast),
        channel("arm/log/never", COLUMNS_KIND, ("one",), np.zeros(0)),
        channel("arm/command/direct/effort", JOINTS_KIND, JOINT_NAMES[:2], slow),
    ]
    events = [
        Event(100.0, "arm", "start", ""),
        Event(100.25, "arm", "abort", "joint 'elbow_ü': 3 > 2"),
        Event(101, "", "x"),
    ]
    channels = {each.name: each for each in (*joints, *shaped, odometry, *others)}
    files = {"robot.urdf": b"<robot/>", "configuration.yaml": b"", "numbers.bin": bytes(range(256))}
    return Recording(channels, events, files, {"seed": "3", "note": "größer"}, lost=4)


@pytest.fixture
def path(recording, tmp_path):
    path = tmp_path / "run.mcap"
    save(recording, path)
    return path


def bits(values):
    return np.ascontiguousarray(values).view(np.int64)


def test_everything_is_read_back(recording, path):
    found = read(path)
    assert set(found.channels) == set(recording.channels)
    for name, sent in recording.channels.items():
        got = found[name]
        np.testing.assert_array_equal(bits(got.values), bits(sent.values), err_msg=name)
        np.testing.assert_allclose(got.times, sent.times, rtol=0, atol=0.6e-9)
        same = (got.kind, got.columns, got.units, got.frame, got.child)
        assert same == (sent.kind, sent.columns, sent.units, sent.frame, sent.child)
    assert found.events == recording.events and found.lost == 4 and found.missing == ()
    assert found.attachments == recording.attachments and found.metadata == recording.metadata
    assert found.plugins == ("arm",)


def numbers_of(kind, message):
    """Return the numbers of a message that another reader decoded, by the last part of our channel."""
    if kind == JOINTS_KIND:
        return {part: getattr(message, part) for part in ("position", "velocity", "effort")}
    if kind == COLUMNS_KIND:
        return {"": message.values}
    if kind == ODOMETRY:
        return {"": [*_leaves(message.pose.pose), *_leaves(message.twist.twist)]}
    body = next(
        getattr(message, name)
        for name in ("point", "vector", "quaternion", "pose", "twist", "wrench")
        if hasattr(message, name)
    )
    return {"": _leaves(body)}


def _leaves(message):
    for axis in ("position", "orientation", "linear", "angular", "force", "torque", *"xyzw"):
        if hasattr(message, axis):
            value = getattr(message, axis)
            yield from _leaves(value) if hasattr(value, "x") else (value,)


def compare(recording, decoded):
    """Compare what another reader found, (topic, kind, time, message), with what was written."""
    found = {}
    for topic, kind, time, message in decoded:
        for part, numbers in numbers_of(kind, message).items():
            name = f"{topic[1:]}/{part}".removesuffix("/")
            if name in recording.channels:
                found.setdefault(name, []).append((time, message.header, list(numbers)))
            else:
                assert not list(numbers)  # a field of joints that this topic does not carry
    for name, sent in recording.channels.items():
        rows = found.pop(name, [])
        assert len(rows) == len(sent.times), name
        for row, (time, header, numbers) in enumerate(rows):
            np.testing.assert_array_equal(bits(np.array(numbers, float)), bits(sent.values[row]), err_msg=name)
            stamp = header.stamp.sec * 10**9 + header.stamp.nanosec
            assert (time, header.frame_id) == (stamp, sent.frame) and abs(time - 1e9 * sent.times[row]) < 20
    assert not found


@pytest.mark.slow
def test_mcap_with_ros2_support_reads_it(recording, path):
    """The reference reader checks all CRCs and decodes every message, attachment and event as ROS 2 types."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        messages = list(reader.iter_decoded_messages())
        assert reader.get_summary().statistics.message_count == len(messages)
        files = {each.name: each.data for each in reader.iter_attachments()}
    events = [each.decoded_message.status[0] for each in messages if each.channel.topic == "/events"]
    kept = [
        (each.channel.topic, each.schema.name.replace("/msg/", "/"), each.message.log_time, each.decoded_message)
        for each in messages
        if each.channel.topic != "/events"
    ]
    compare(recording, kept)
    assert files == recording.attachments
    assert [(event.name, event.values[0].value, event.message) for event in events] == [
        (event.plugin, event.kind, event.text) for event in recording.events
    ]
    assert [event.level for event in events] == [0, 2, 0]


@pytest.mark.slow
def test_pybag_reads_it(recording, tmp_path):
    """A reader that shares no code with ours: messages, attachments, metadata and events agree."""
    # joints with all fields: pybag cannot read an empty list behind which nothing follows
    times = 100.0 + 1e-3 * np.arange(700)
    whole = [channel(f"arm/measured/{part}", JOINTS_KIND, JOINT_NAMES, times) for part in JOINT_PARTS]
    kept = [
        each for each in recording.channels.values() if each.kind != JOINTS_KIND and each.columns and len(each.times)
    ]
    recording = replace(recording, channels={each.name: each for each in (*whole, *kept)})
    path = tmp_path / "whole.mcap"
    save(recording, path)
    with McapFileReader.from_file(path, enable_crc_check=True) as reader:
        kinds = {topic: reader.get_schema(topic).name.replace("/msg/", "/") for topic in reader.get_topics()}
        decoded = [
            (topic, kind, each.log_time, each.data)
            for topic, kind in kinds.items()
            if topic != "/events"
            for each in reader.messages(topic)
        ]
        texts = {each.name: each.metadata for each in reader.get_metadata()}
        events = [each.data.status[0] for each in reader.messages("/events")]
    with McapFileReader.from_file(path) as reader:  # its checksum of attachments leaves out their names
        files = {each.name: each.data for each in reader.get_attachments()}
    compare(recording, decoded)
    assert files == recording.attachments and texts["solfer"] == recording.metadata
    assert [(each.name, each.message) for each in events] == [(each.plugin, each.text) for each in recording.events]


@pytest.mark.slow
def test_rosbags_reads_it(recording, path):
    with AnyReader([Path(path)]) as reader:
        connections = [each for each in reader.connections if each.topic != "/events"]
        decoded = [
            (each.topic, each.msgtype.replace("/msg/", "/"), time, reader.deserialize(raw, each.msgtype))
            for each, time, raw in reader.messages(connections)
        ]
    compare(recording, decoded)


def written(path, rows, block_rows=10):
    """Write a file that is not finished; return where each of its chunks ends."""
    writer, ends = RecordingWriter(path, {"robot.urdf": b"<robot/>"}), []
    block = writer.block([Channel("arm/log/x", COLUMNS_KIND, ("x",), ("m",))])
    for first in range(1, rows, block_rows):
        numbers = np.arange(first, first + block_rows)
        writer.write(block, numbers, 1_000_000 * numbers, numbers[:, None] * 1.0)
        ends.append(writer.size)
    writer.close()
    return ends


@pytest.mark.slow
def test_cut_file_keeps_its_whole_chunks(tmp_path):
    path = tmp_path / "cut.mcap"
    ends = written(path, 30)
    content = path.read_bytes()
    for size in range(ends[0], len(content)):
        path.write_bytes(content[:size])
        found = read(path)
        rows = len(found["arm/log/x"].times)
        assert rows >= 10 * sum(size >= end for end in ends)
        np.testing.assert_array_equal(found["arm/log/x"].values[:, 0], np.arange(1, rows + 1))
        assert "its writer was killed" in found.missing[-1] and found.attachments


def test_damaged_chunk_is_left_out(tmp_path):
    path = tmp_path / "damaged.mcap"
    ends = written(path, 30)
    content = bytearray(path.read_bytes())
    content[ends[0] + 70] ^= 1
    path.write_bytes(content)
    found = read(path)
    assert found["arm/log/x"].values[:, 0].tolist() == [*range(1, 11), *range(21, 31)]
    assert found.lost == 10 and "damaged rows between 0.011 s and 0.020 s" in found.missing


def test_rows_that_lack_are_counted(tmp_path):
    writer = RecordingWriter(tmp_path / "gaps.mcap")
    block = writer.block([Channel("arm/log/x", COLUMNS_KIND, ("x",), ("m",))])
    numbers = np.array([2**32 - 1, 2**32 + 3, 2**32 + 4])
    writer.write(block, numbers, numbers, np.zeros((3, 1)))
    writer.close()
    assert read(writer.path).lost == 3


@pytest.mark.parametrize(
    ("name", "kind", "columns", "error", "text"),
    [
        ("arm/x", "sensor_msgs/Joint", ("x",), UnknownName, "sensor_msgs/JointState"),
        ("arm/positions", JOINTS_KIND, ("x",), RecordingError, "expected: <name>/{position,velocity,effort}"),
        ("arm/x", WRENCH, ("x",), RecordingError, "expected: fx fy fz tx ty tz"),
    ],
)
def test_wrong_channel_is_one_clear_error(tmp_path, name, kind, columns, error, text):
    with pytest.raises(error) as caught:
        RecordingWriter(tmp_path / "x.mcap").block([Channel(name, kind, columns, ("",))])
    assert text in str(caught.value) and f"channel '{name}'" in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"not a recording at all"])
def test_file_that_is_no_recording(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="this is no MCAP file"):
        read(path)
    with pytest.raises(RecordingError, match="No such file"):
        read(tmp_path / "y.mcap")


def test_file_replaces_link_instead_of_following_it(tmp_path, recording):
    kept, link = tmp_path / "kept", tmp_path / "run.mcap"
    kept.write_text("precious")
    link.symlink_to(kept)
    save(recording, link)
    assert kept.read_text() == "precious" and read(link).missing == ()
    with pytest.raises(RecordingError, match="cannot be written: No such file"):
        save(recording, tmp_path / "nowhere" / "run.mcap")


def test_each_topic_says_its_quality_of_service(path):
    """As MCAP's profile `ros2` asks for; the numbers are those of `rmw/types.h`: reliable, volatile, keep the last."""
    with Path(path).open("rb") as file:
        reader = make_reader(file)
        channels = reader.get_summary().channels.values()
        assert reader.get_header().profile == "ros2" and len(channels) > 2
    for each in channels:
        (profile,) = yaml.safe_load(each.metadata["offered_qos_profiles"])
        assert (profile["history"], profile["reliability"], profile["durability"]) == (1, 1, 2)
        assert profile["deadline"] == {"sec": 9223372036, "nsec": 854775807}
