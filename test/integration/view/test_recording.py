"""A recording of CENTAURO that drives, on the page: each link is where the rows of the file say, by Pinocchio alone."""

from contextlib import closing

import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page, view  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.middleware.memory import Bus, MemoryMiddleware  # noqa: E402
from solfer.recording.model import JOINTS_KIND, Channel  # noqa: E402
from solfer.recording.reader import read  # noqa: E402
from solfer.recording.reading.pieces import RecordingPieces  # noqa: E402
from solfer.recording.writer import RecordingWriter  # noqa: E402
from solfer.robot.description.shipped import robot_of  # noqa: E402
from solfer.telemetry.rows import RowLayout  # noqa: E402
from solfer_tools.scene import LiveScene  # noqa: E402
from solfer_tools.study import SimulatedRun, read_study  # noqa: E402
from solfer_tools.view import Page, PageServer, Playback  # noqa: E402

pytestmark = pytest.mark.slow

SPAN, PERIOD = 3.0, 0.01
"""Of the recording, and of its rows [s]."""

NEAR = 2e-4
"""Page and file differ by what a link may move without a message [m]; it is twice that for an entry of a rotation."""


def write(path, study):
    """Write what the plugins of a study do first."""
    with SimulatedRun(read_study(study).record) as run:
        layout, arrays = RowLayout.of(run.sources, {}, {})
        rows = []
        times = []
        for _ in range(round(SPAN / PERIOD)):
            run.step(PERIOD)
            rows.append(np.concatenate(arrays))
            times.append(round(1e9 * run.bus.time))
    writer = RecordingWriter(path)
    numbers = np.arange(1, len(rows) + 1)
    writer.write(writer.block(layout.channels), numbers, np.array(times), layout.values(np.array(rows)))
    writer.finish()


class LinkPoses:
    """Poses of links at a time, of the rows of a file; two plugins measure as many joints, and the first one counts."""

    def __init__(self, recording, urdf):
        self._joints, self._base = recording["odometry/measured/position"], recording["odometry/command/odom"]
        self._model = pinocchio.buildModelFromXML(urdf, pinocchio.JointModelFreeFlyer())
        self._data = self._model.createData()

    def at(self, time):
        """Return position and orientation of each link."""
        row = np.searchsorted(self._joints.times, time, side="right") - 1
        q = pinocchio.neutral(self._model)
        for name, value in zip(self._joints.columns, self._joints.values[row], strict=True):
            if not self._model.existJointName(name):
                continue  # the chart of the base
            joint = self._model.joints[self._model.getJointId(name)]
            q[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
        pinocchio.framesForwardKinematics(self._model, self._data, q)
        bodies = [each for each in self._model.frames if each.type == pinocchio.FrameType.BODY]
        placed = {each.name: self._data.oMf[self._model.getFrameId(each.name, each.type)] for each in bodies}
        moved = pinocchio.XYZQUATToSE3(self._base.values[row, :7]) * placed[self._base.child].inverse()
        return {name: moved * pose for name, pose in placed.items()}


def test_each_link_is_where_the_file_has_it(repository, tmp_path):
    """At 10 instants, in any order, all links of the page, positions and orientations."""
    file = tmp_path / "run.mcap"
    write(file, repository / "config/studies/robustness.yaml")
    recording = read(file)
    files = robot_of("centauro")[1]
    robot = Robot.load(files.urdf, files.srdf, files.floating_base, name="centauro", contacts=files.contacts)
    bus = Bus()
    playback = Playback(RecordingPieces(file), MemoryMiddleware(bus, "recording"), robot)
    playback.plays = False
    node = MemoryMiddleware(bus, "view")
    scene = LiveScene(robot, node)
    reference = LinkPoses(recording, robot.description.text)
    places = []
    with closing(PageServer(0)) as server:
        page = Page(server, robot.description, node, playback=playback)
        with opened_page(server.address) as client:
            for time in np.random.default_rng(0).uniform(playback.begin, playback.end, 10):
                playback.seek(time)
                for _ in range(3):
                    bus.run_until(bus.time + 0.05)
                    playback.advance(0.05)
                    page.update(scene.update())
                    client.receive(0.1)
                expected = reference.at(time)
                names = [name for name in client.positions if name.startswith("/measured/")]
                assert len(names) > 30
                for name in names:
                    pose = expected[name.rpartition("/")[2]]
                    np.testing.assert_allclose(client.positions[name], pose.translation, atol=NEAR, err_msg=name)
                    turn = Rotation.from_quat(np.roll(client.turns[name], -1)).as_matrix()
                    np.testing.assert_allclose(turn, pose.rotation, atol=2.0 * NEAR, err_msg=name)
                places.append(client.positions["/measured/pelvis"])
    assert np.ptp(places, axis=0).max() > 0.05, "it does not drive"


SHAPES = (
    '<mesh filename="absent.stl"/>',
    '<mesh filename="package://absent/a.dae" scale="1e308 1 1"/>',
    '<mesh filename="{junk}"/>',
    "<mesh/>",
    '<sphere radius="1e308"/>',
    '<cylinder radius="1e-320" length="1"/>',
    '<capsule radius="0.1" length="0.1"/>',
)


def test_shapes_that_cannot_be_read_end_nothing(tmp_path):
    """`solfer view FILE` shows the links of a recording without them: each has a box as well."""
    junk = tmp_path / "junk.stl"
    junk.write_bytes(b"solid " + 200 * b"\xff")
    visual = "<visual><geometry>{}</geometry></visual>"
    box = visual.format('<box size="1 1 1"/>')
    links = "".join(
        f'<link name="link_{index}">{visual.format(shape.format(junk=junk))}{box}</link>'
        for index, shape in enumerate(SHAPES)
    )
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="base"/><child link="link_{index}"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for index, name in enumerate(("elbow", *range(1, len(SHAPES))))
    )
    robot = f'<robot name="r"><link name="base">{box}</link>{links}{joints}</robot>'
    writer = RecordingWriter(tmp_path / "run.mcap", {"hands/robot.urdf": robot.encode()})
    times = np.arange(10.0)
    channel = Channel(
        "hands/measured/position", JOINTS_KIND, ("elbow",), ("rad",), times=times, values=0.1 * times[:, None]
    )
    writer.write(writer.block([channel]), np.arange(1, 11), (1e9 * times).astype(int), channel.values)
    writer.finish()
    with view(str(writer.path)) as address, opened_page(address) as page:
        shown = {f"/measured/{name}" for name in ("base", *(f"link_{index}" for index in range(len(SHAPES))))}
        page.until(lambda: shown <= set(page.positions) and "time [s]" in page.labels, "the robot")
