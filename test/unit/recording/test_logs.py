"""What reads recordings: `solfer log`, `solfer plot`, and choosing columns."""

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_typestore

from solfer.model import Description
from solfer.recording.kinds import NAMED
from solfer.recording.model import COLUMNS_KIND, JOINTS_KIND, REQUEST, Channel, Event, Recording
from solfer.recording.reader import read
from solfer.recording.writer import save
from solfer_tools.cli.main import main
from solfer_tools.cli.recordings.actions import limits_of
from solfer_tools.cli.recordings.progress import progress
from solfer_tools.review import tracks_of
from solfer_tools.review.canvas import COLORS, LINE_POINTS, outline
from solfer_tools.review.columns_page import columns_page
from solfer_tools.review.plugin_page import plugin_page

URDF = Path(__file__).parents[3] / "config/robots/centauro/centauro.urdf"
RATE, START = 100.0, 50.0
JOINTS_OF_ARM = ("j_arm1_1", "j_arm1_2", "j_wheel_1")


def channel(name, columns, kind=JOINTS_KIND, unit="rad", times=None, seed=0):
    times = START + np.arange(200) / RATE if times is None else times
    values = np.cumsum(np.random.default_rng(seed).standard_normal((len(times), len(columns))), axis=0) / RATE
    return Channel(name, kind, tuple(columns), (unit,) * len(columns), "", times, values)


@pytest.fixture
def recording():
    """Make a recording of a plugin that commands two joints by position and a wheel by velocity."""
    late = START + 0.5 + np.arange(100) / RATE
    channels = [
        channel("arm/measured/position", JOINTS_OF_ARM),
        channel("arm/measured/velocity", JOINTS_OF_ARM, unit="rad/s", seed=1),
        channel("arm/command/direct/position", JOINTS_OF_ARM[:2], times=late, seed=2),
        channel("arm/command/wheels/velocity", JOINTS_OF_ARM[2:], unit="rad/s", seed=3),
        channel("arm/feedback/direct/age", ("age",), COLUMNS_KIND, "s", seed=4),
        channel("arm/timing", ("read", "component"), COLUMNS_KIND, "s", seed=5),
        channel("arm/log/com", ("x", "y", "z"), "geometry_msgs/PointStamped", "m", seed=6),
        channel("leg/log/slip", ("slip",), COLUMNS_KIND, "m", seed=7),
    ]
    events = [Event(START, "arm", "start"), Event(START + 1.5, "arm", "stop", "asked to")]
    files = {"arm/robot.urdf": URDF.read_bytes()}
    return Recording({each.name: each for each in channels}, events, files, {"seed": "3"})


@pytest.fixture
def file(recording, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save(recording, tmp_path / "run.mcap")
    return "run.mcap"


def test_info_lists_what_a_file_holds(file, capsys):
    assert main(["log", "info", file]) == 0
    text = capsys.readouterr().out
    assert "duration: 1.990 s, 200 rows, 0 lost" in text
    assert "event at 1.500 s: arm: stop asked to" in text and "attachment: arm/robot.urdf (73.6 kB)" in text
    line = next(line for line in text.splitlines() if line.startswith("arm/measured/position"))
    assert line.split() == ["arm/measured/position", "3", "200", "100.0", "sensor_msgs/JointState"]


@pytest.fixture
def busy(recording):
    """Add requests: many of one name, the last one cut, and two of another one."""
    asked = [Event(START + 0.1 + 0.01 * each, "arm", REQUEST, f'["reference", [{each}]]') for each in range(123)]
    asked[-1] = Event(START + 1.9, "arm", REQUEST, '["reference", [0.12')
    rare = [Event(START + each, "arm", REQUEST, f'["halt", [{each}]]') for each in (0.5, 1.0)]
    return dataclasses.replace(recording, events=sorted([*recording.events, *asked, *rare], key=lambda each: each.time))


def test_requests_that_come_often_are_counted(busy, tmp_path, capsys):
    save(busy, tmp_path / "busy.mcap")
    assert main(["log", "info", str(tmp_path / "busy.mcap")]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith(("event", "requests"))]
    assert lines == [
        "event at 0.000 s: arm: start",
        "requests: arm: 123 x reference, 0.1 to 1.9 s",
        'event at 0.500 s: arm: request ["halt", [0.5]]',
        'event at 1.000 s: arm: request ["halt", [1.0]]',
        "event at 1.500 s: arm: stop asked to",
    ]


@pytest.mark.slow
def test_a_plot_counts_requests_in_its_title(busy):
    """Four events that are alone, and the first and the last of the others, are lines in each plot."""
    figure = plugin_page(busy, "arm", {})
    assert figure.get_suptitle().splitlines()[1:] == ["123 x reference, 0.1 to 1.9 s"]
    (axes,) = [axes for part in figure.subfigs for axes in part.axes if axes.get_title("left").startswith("age")]
    dotted = [line for line in axes.get_lines() if line.get_linestyle() == ":"]
    assert len(dotted) == 6


def test_limits_are_those_of_the_plugin(recording):
    joint = Description.from_file(URDF).joints["j_arm1_1"]
    assert limits_of(recording, "arm")["j_arm1_1"] == (joint.lower, joint.upper)
    assert limits_of(recording, "leg") == {}


def test_a_cut_keeps_chosen_rows_and_columns(file, recording, capsys):
    assert main(["log", "cut", file, "-o", "part.mcap", "--from", "0.5", "--to", "1", "-c", "j_arm1_2"]) == 0
    part, whole = read(Path("part.mcap")), recording["arm/measured/position"]
    assert {name: each.columns for name, each in part.channels.items()} == dict.fromkeys(
        ("arm/measured/position", "arm/measured/velocity", "arm/command/direct/position"), ("j_arm1_2",)
    )
    np.testing.assert_array_equal(part["arm/measured/position"].values, whole.values[50:101, 1:2])
    assert part.attachments == recording.attachments and part.events == []


def test_csv_is_read_back_to_the_bit(file, recording, capsys):
    assert main(["log", "export", file, "--csv", "out", "-c", "arm/measured/*"]) == 0
    assert sorted(path.name for path in Path("out").iterdir()) == [
        "arm.measured.position.csv", "arm.measured.velocity.csv"
    ]  # fmt: skip
    with open("out/arm.measured.position.csv") as table:
        head, *rows = csv.reader(table)
    assert head == ["time [s]", "j_arm1_1 [rad]", "j_arm1_2 [rad]", "j_wheel_1 [rad]"]
    np.testing.assert_array_equal(np.array(rows, float)[:, 1:], recording["arm/measured/position"].values)


def test_arrays_are_read_back_to_the_bit(file, recording, capsys):
    assert main(["log", "export", file, "--npz", "out.npz", "-c", "arm/timing"]) == 0
    with np.load("out.npz") as arrays:
        np.testing.assert_array_equal(arrays["arm/timing"], recording["arm/timing"].values)
        assert "arm/measured/position" not in arrays


def test_a_bag_has_the_same_numbers(file, recording, capsys):
    """An independent reader of bags finds names, values, times and labels of the MCAP recording."""
    assert main(["log", "export", file, "--bag", "out.bag"]) == 0
    store, seen = get_typestore(Stores.ROS1_NOETIC), {}
    with Reader(Path("out.bag")) as bag:
        for connection, time, data in bag.messages():
            message = store.deserialize_ros1(data, connection.msgtype)
            seen.setdefault(connection.topic, []).append((time, message))
    times, messages = zip(*seen["/arm/measured"], strict=True)
    assert [tuple(message.name) for message in messages[:1]] == [JOINTS_OF_ARM]
    for field in ("position", "velocity"):
        numbers = np.array([getattr(message, field) for message in messages])
        np.testing.assert_array_equal(numbers, recording[f"arm/measured/{field}"].values)
    np.testing.assert_allclose(1e-9 * np.array(times), recording["arm/measured/position"].times, atol=1e-9)
    points = np.array([(m.point.x, m.point.y, m.point.z) for _, m in seen["/arm/log/com"]])
    np.testing.assert_array_equal(points, recording["arm/log/com"].values)
    labels = seen["/arm/timing"][0][1].layout.dim[0].label
    assert labels == "read,component"


@pytest.mark.parametrize("kind", [COLUMNS_KIND, JOINTS_KIND])
@pytest.mark.parametrize("first", [0.0, 1e-10])
def test_no_message_of_a_bag_is_at_time_0(kind, first, tmp_path, monkeypatch, capsys):
    """Time 0 stands for no time in ROS 1, whose `rosbag play` leaves such messages out."""
    monkeypatch.chdir(tmp_path)
    name = "arm/measured/position" if kind == JOINTS_KIND else "arm/log/x"
    times = first + 0.005 * np.arange(4)
    save(Recording({name: Channel(name, kind, ("x",), ("rad",), "", times, times[:, None], "")}), tmp_path / "run.mcap")
    assert main(["log", "export", "run.mcap", "--bag", "out.bag"]) == 0
    with Reader(Path("out.bag")) as bag:
        assert [time for _, time, _ in bag.messages()] == [1, 5_000_000, 10_000_000, 15_000_000]


@pytest.mark.parametrize("kind", NAMED)
def test_each_kind_fits_into_a_bag(kind, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    saved = channel("arm/log/it", NAMED[kind], kind)
    save(Recording({saved.name: saved}), tmp_path / "run.mcap")
    assert main(["log", "export", "run.mcap", "--bag", "out.bag"]) == 0
    store = get_typestore(Stores.ROS1_NOETIC)
    with Reader(Path("out.bag")) as bag:
        connection, _, data = next(bag.messages())
        text = repr(store.deserialize_ros1(data, connection.msgtype))
    assert connection.msgtype == kind.replace("/", "/msg/")
    assert all(f"={float(number)!r}" in text for number in saved.values[0])


def test_one_column_of_a_point_is_a_column(file, recording, capsys):
    assert main(["log", "cut", file, "-o", "part.mcap", "-c", "arm/log/com/x"]) == 0
    part = read(Path("part.mcap"))["arm/log/com"]
    assert (part.kind, part.columns) == (COLUMNS_KIND, ("x",))
    np.testing.assert_array_equal(part.values, recording["arm/log/com"].values[:, :1])
    assert main(["log", "export", file, "--bag", "out.bag", "-c", "arm/log/com/x"]) == 0
    with Reader(Path("out.bag")) as bag:
        assert {connection.msgtype for connection in bag.connections} == {"std_msgs/msg/Float64MultiArray"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["log", "info", "none.mcap"], "none.mcap: the recording cannot be read: No such file or directory"),
        (["log", "info", "text.mcap"], "text.mcap: this is no MCAP file"),
        (["log", "export", "run.mcap", "--csv", "out", "-c", "j_arm1_9"], "did you mean: j_arm1_2"),
        (["log", "cut", "run.mcap", "-o", "run.mcap"], "run.mcap: a recording is not cut into itself"),
        (["log", "cut", "run.mcap", "-o", "no.mcap", "--from", "9"], "times from 0 to 1.99 s"),
        (["log", "export", "run.mcap", "--bag", "none/out.bag"], "the bag cannot be written: No such file"),
        (["log", "export", "run.mcap", "--csv", "text.mcap"], "the CSV files cannot be written"),
        (["plot", "run.mcap", "-o", "out.gif"], "a file that ends with .pdf or .png"),
        (["plot", "run.mcap", "-o", "out.png", "-c", "arm/timin"], "did you mean: arm/timing"),
        (["plot", "run.mcap", "-o", "none/out.png", "-c", "j_arm1_1"], "the picture cannot be written: No such file"),
    ],
)
def test_a_mistake_is_one_clear_error(file, arguments, message, capsys):
    Path("text.mcap").write_text("no recording at all")
    before = Path("run.mcap").read_bytes()
    assert main(arguments) == 2
    text = capsys.readouterr().err
    assert message in text and "Traceback" not in text and text.count("error:") == 1
    assert Path("run.mcap").read_bytes() == before


def test_a_cut_off_file_says_what_is_missing(file, capsys):
    content = Path(file).read_bytes()
    Path("cut.mcap").write_bytes(content[: len(content) // 2])
    assert main(["log", "info", "cut.mcap"]) == 0
    assert "warning: missing: " in capsys.readouterr().err


def test_what_is_desired_is_found_for_each_joint(recording):
    tracks = {track.joint: track for track in tracks_of(recording, "arm")}
    assert [(track.joint, track.field, track.unit) for track in tracks.values()] == [
        ("j_arm1_1", "position", "rad"), ("j_arm1_2", "position", "rad"), ("j_wheel_1", "velocity", "rad/s")
    ]  # fmt: skip
    error, sent = tracks["j_arm1_1"].error(), recording["arm/command/direct/position"]
    assert np.isnan(error[:50]).all() and not np.isnan(error[50:]).any()
    held = np.concatenate([sent.values[:, 0], np.full(50, sent.values[-1, 0])])
    np.testing.assert_allclose(error[50:], held - recording["arm/measured/position"].values[50:, 0], atol=1e-12)


def test_long_lines_keep_their_peaks():
    values = np.zeros(100_000)
    values[[777, 54_321]] = 1.0, -1.0
    kept = outline(values)
    assert len(kept) <= LINE_POINTS + 2 and {777, 54_321, 0, 99_999} <= set(kept)


@pytest.mark.slow
def test_each_plugin_has_its_picture(file, capsys):
    assert main(["plot", file, "-o", "out.png"]) == 0
    assert capsys.readouterr().out.split() == ["out_arm.png", "out_leg.png"]
    pixels = imread("out_arm.png")
    assert pixels.shape[1] == 1650 and np.unique(pixels[::7, ::7, :3].reshape(-1, 3), axis=0).shape[0] > 20
    assert main(["plot", file, "-o", "out.pdf", "-c", "j_arm1_1", "-c", "arm/timing"]) == 0
    assert Path("out.pdf").read_bytes()[:4] == b"%PDF"
    for name, arguments in (("whole", []), ("chosen", ["-c", "arm/measured/*"])):
        assert main(["plot", file, "-o", f"{name}.png", "--column", *arguments]) == 0
    assert {imread(file).shape[1] for file in ("whole_arm.png", "chosen.png")} == {1050}  # 3.5 inch of 300 pixels


@pytest.mark.slow
def test_an_erring_wheel_hides_no_joint(recording):
    """Joints of a kind have one scale; the time stands on the page once."""
    steered = recording["arm/measured/position"]
    steered.values[:, 1] *= 1e3
    names = ("j_arm1_1", "j_ankle_1", "j_wheel_1")
    for name, each in recording.channels.items():
        if each.columns == JOINTS_OF_ARM[: len(each.columns)]:
            recording.channels[name] = dataclasses.replace(each, columns=names[: len(each.columns)])
    figure = plugin_page(recording, "arm", {})
    (image,) = [image for part in figure.subfigs for axes in part.axes for image in axes.get_images()]
    assert np.nanmax(np.abs(image.get_array()), axis=1).min() > 0.9
    assert figure.get_supxlabel() == "time [s]"
    assert {axes.get_xlabel() for part in figure.subfigs for axes in part.axes} == {
        "",
        "part of the scale on the right",
    }


@pytest.mark.slow
def test_lines_have_eight_colours_and_dashes_after_them(recording):
    wide = channel("arm/log/wide", [f"c{each}" for each in range(30)], COLUMNS_KIND, "m")
    figure = columns_page(dataclasses.replace(recording, channels={"arm/log/wide": wide}))
    lines = figure.axes[0].get_lines()
    looks = [(line.get_color(), line.get_linestyle()) for line in lines]
    assert len(set(looks)) == len(looks) == 12 and {color for color, _ in looks} == set(COLORS) and len(COLORS) == 8
    assert len(figure.axes[0].get_legend().get_texts()) == 12


def test_progress_is_shown_on_a_terminal_alone(capsys, monkeypatch):
    monkeypatch.setattr("solfer_tools.cli.recordings.progress.DELAY", 0.0)
    monkeypatch.setattr("solfer_tools.cli.recordings.progress.PERIOD", 0.0)
    assert list(progress(range(3), 3, "rows")) == [0, 1, 2]
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert list(progress(range(3), 3, "rows")) == [0, 1, 2]
    assert "] 3 of 3 rows" in capsys.readouterr().err
