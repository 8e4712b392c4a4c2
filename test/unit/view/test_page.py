"""The page of a robot on a bus, by a page without a browser."""

import re
import socket
import time
from contextlib import closing
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

viser = pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page  # noqa: E402
from support.page_bench import PageBench  # noqa: E402
from support.robots import upper_body  # noqa: E402
from viser import _messages  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.simulation.server.services import PushRequest, ResetRequest  # noqa: E402
from solfer.simulation.world.world import find_world, read_world  # noqa: E402
from solfer.transport.health import Health  # noqa: E402
from solfer.transport.lower_level import Answer  # noqa: E402
from solfer.transport.middleware import Flag, NoFields  # noqa: E402
from solfer.transport.parameters import GetParameters, ParametersReply, SetParameters  # noqa: E402
from solfer_tools.scene import ScenePose  # noqa: E402
from solfer_tools.scene.world import surfaces_of  # noqa: E402

pytestmark = pytest.mark.slow

DRAG = _messages.TransformControlsUpdateMessage("/drag/hands/left", (1.0, 0.0, 0.0, 0.0), (0.6, 0.1, 0.4))


@pytest.fixture
def bench(repository, request):
    made = PageBench(upper_body(), getattr(request, "param", True))
    made.run(3)
    with opened_page(made.server.address) as client, opened_page(made.server.address) as other:
        made.clients = [client, other]
        made.run(10)
        yield made
    made.server.close()


def has(bench, label):
    return label in bench.clients[0].labels


def until_it_may_drive(bench):
    """Wait until it is known who drives, and what has a reference."""
    bench.until(lambda: "ahead" in bench.content and has(bench, "gain [1/s]"))


def command(bench):
    """Let the first page command."""
    bench.clients[0].click("take control")
    bench.until(lambda: "you have control" in bench.content)


def test_links_are_where_the_robot_measures_them(bench):
    bench.robot.command.position[:] = np.linspace(-0.3, 0.3, bench.robot.size)
    bench.run(10)
    robot = Robot.load(bench.robot.description.text)
    robot.state.position[:] = bench.robot.command.position
    robot.update()
    seen = bench.clients[0].positions
    shown = [name for name in seen if name.startswith("/measured/")]
    assert len(shown) > 5
    for name in shown:
        assert_allclose(seen[name], robot.kinematics.position(name.rpartition("/")[2]), atol=1e-4, err_msg=name)
    assert_allclose(seen["/center/mass"], robot.kinematics.center_of_mass, atol=1e-4)
    assert_allclose(seen["/references/hands/left"], bench.state.references[0].reference.position, atol=1e-5)


def test_the_world_of_a_simulation_is_seen(bench):
    bench.bus.parameters["/world_file"] = str(find_world("steps"))
    bench.run(50)
    expected = {f"/world/{each.name}" for each in surfaces_of(read_world(find_world("steps")))}
    assert expected and expected <= {*bench.page._drawing._api._handle_from_node_name}


def test_each_page_has_its_own_view(bench):
    """It follows the base or not, looks from a side of the robot's own heading, and hides what others see."""
    client, other = bench.clients
    bench.until(lambda: client.cameras and other.cameras)
    turned = ScenePose(np.array((1.0, 2.0, 0.7)), Rotation.from_euler("z", 90, degrees=True).as_matrix())
    client.change("camera follows the base", False)
    bench.run(3)
    before = client.positions[""]
    bench.page._views.update(turned)
    client.change("look at", "front")
    client.change("names", False)
    bench.page._views.update(turned)
    for page in bench.clients:
        page.receive(0.3)
    bench.page._requests.update()
    client.receive(0.3)
    other.receive(0.3)
    assert_allclose(other.positions[""], (-1.0, 0.0, 2.0))
    assert_allclose(client.positions[""], before)
    assert_allclose(client.cameras[-1], (1.0, 5.6, 0.9))
    assert len(other.cameras) == 1 and client.visible["/names"] is False and other.visible["/names"]
    for height, ground in ((3.1, 2.0), (2.5, 2.0), (1.0, 1.0)):  # up a hill, a squat there, down
        bench.page._views.update(ScenePose(np.array((1.0, 2.0, height)), turned.rotation))
        other.receive(0.3)
        assert_allclose(other.positions[""], (-1.0, -ground, 2.0))


def test_a_desired_link_is_drawn_where_it_differs(bench):
    measured = bench.state.measured
    offsets = {"arm1_7": 3e-3, "arm1_6": 1e-3}  # [m]
    moved = {
        name: replace(pose, position=pose.position + (offsets.get(name, 0.0), 0.0, 0.0))
        for name, pose in measured.items()
    }
    bench.page._drawing.update(replace(bench.state, desired=moved))
    client = bench.clients[0]
    client.receive(0.3)
    links = {name: shown for name, shown in client.visible.items() if re.fullmatch("/desired/links/[^/]+", name)}
    assert links.pop("/desired/links/arm1_7", True) and len(links) > 5 and not any(links.values())


def test_the_beat_of_the_banner_stops_with_what_is_published(bench):
    assert "what you see is" in bench.clients[0].scripts[0] and "0.5" in bench.clients[0].scripts[0]
    before = bench.beat
    bench.run(10)
    assert bench.beat > before
    bench.is_publishing = False
    bench.run(14)
    stood = bench.beat
    bench.run(10)
    assert bench.beat == stood


def test_a_tab_has_health_with_reason_and_figures(bench):
    assert "waits for &lt;odometry&gt;" in bench.content and "WARNING" in bench.content
    assert any("alert-triangle" in str(props.get("_tab_icons_html")) for props in bench.clients[0].gui.values())
    assert "cycle p99 [ms]" in bench.content and "1.25" in bench.content


@pytest.mark.parametrize("bench", [False], indirect=True)
def test_the_emergency_stop_asks_once_and_needs_no_control(bench):
    client = bench.clients[0]
    assert "`solfer view --control` also drives" in client.content
    client.click("EMERGENCY STOP")
    bench.until(lambda: has(bench, "stop the robot now"))
    assert client.modals and "sinks to the ground" in client.content and not bench.asked
    client.click("stop the robot now")
    bench.until(lambda: bench.asked)
    assert bench.asked == [NoFields()]


def test_a_page_shows_the_stop_and_clears_it(bench):
    """Only while it is stopped, by the page with control, after a question that says what the robot will do."""
    bench.until(lambda: has(bench, "clear the stop"))
    client, other = bench.clients
    clear = client.find("clear the stop")
    client.click("clear the stop")
    bench.run(3)
    assert not client.modals and "WARNING hands" in client.content
    bench.node.report("lower_level", Health.ERROR, "emergency stop: asked for by service", {})
    bench.until(lambda: "STOPPED: emergency stop: asked for by service" in client.content)
    assert client.gui[clear]["visible"]
    command(bench)
    for page, asked in ((other, []), (client, ["clear"])):
        page.click("clear the stop")
        bench.until(lambda: "clear the stop now" in page.labels)  # noqa: B023
        assert "holds the posture that it has now" in page.content
        page.click("clear the stop now")
        bench.run(6)
        assert bench.asked == asked
    bench.node.report("lower_level", Health.GOOD, "running", {})
    bench.until(lambda: not client.gui[clear]["visible"] and "STOPPED" not in client.content)


@pytest.mark.parametrize("bench", [False], indirect=True)
def test_without_control_nothing_is_commanded(bench):
    bench.until(lambda: has(bench, "gain [1/s]"))
    assert not has(bench, "take control") and not any("/drag/" in name for name in bench.clients[0].nodes)
    bench.clients[0].change("gain [1/s]", 3.0)
    bench.run(10)
    assert not bench.asked


def test_parameters_change_from_the_page_that_commands(bench):
    bench.until(lambda: has(bench, "gain [1/s]"))
    client, other = bench.clients
    command(bench)
    other.change("gain [1/s]", 3.0)
    bench.until(lambda: any("has control since" in note for note in other.notes))
    assert not bench.asked and "has control since" in other.content
    client.change("gain [1/s]", 4.0)
    bench.until(lambda: bench.asked)
    assert bench.asked == [SetParameters(("gain",), ("4.0",))]


FIRST_ACTS = {
    "press": lambda client: client.hold("ahead"),
    "drag": lambda client: client.send(DRAG),
    "change": lambda client: client.change("speed [m/s]", 0.2),
    "life": lambda client: client.change("life", "start"),
}


@pytest.mark.parametrize("act", FIRST_ACTS.values(), ids=FIRST_ACTS)
def test_the_first_act_takes_control_where_nobody_has_it(bench, act):
    until_it_may_drive(bench)
    client, other = bench.clients
    act(client)
    bench.until(lambda: "you have control" in client.content)
    assert client.notes[0] == "you have control now" not in other.notes


def test_parameters_are_searched_saved_and_reset(bench):
    """What is changed is listed with its configured value; a search hides the others; counts are whole numbers."""
    bench.until(lambda: has(bench, "gain [1/s]"))
    client, other = bench.clients
    command(bench)
    assert "nothing is changed" in client.content and "(default: 2)" in str(client.gui[client.find("gain [1/s]")])
    client.change("gain [1/s]", 3.0)
    bench.until(lambda: "gain: 3.0, configured 2" in client.content)
    other.click("save")
    bench.until(lambda: other.files)
    assert "hands:" in other.files[0] and "gain: 3.0" in other.files[0] and not client.files
    for part, is_seen in (("speed", False), ("GAI", True)):
        client.change("search", part)
        bench.until(lambda: client.gui[client.find("gain [1/s]")]["visible"] is is_seen)  # noqa: B023
    other.click("reset")
    bench.run(4)
    client.click("reset")
    bench.until(lambda: "nothing is changed" in client.content)
    assert bench.asked[1:] == [SetParameters(("gain",), ("2",))]
    bench.node.report("hands", Health.GOOD, "running", {"computed": 21798.0, "age [ms]": 1.2345678})
    bench.until(lambda: ">21798<" in client.content and ">1.235<" in client.content)


def test_a_slider_goes_back_where_its_number_is_refused(bench):
    bench.until(lambda: has(bench, "gain [1/s]"))
    command(bench)
    bench.refusal = "too fast"
    client = bench.clients[0]
    client.change("gain [1/s]", 4.0)
    bench.until(lambda: client.gui[client.find("gain [1/s]")].get("value") == 2.0)
    bench.until(lambda: any("too fast" in note for note in client.notes))


def test_a_slider_shows_what_counts(bench):
    """The plugin takes over another number than the one that was requested: all pages show that."""
    bench.until(lambda: has(bench, "gain [1/s]"))
    command(bench)
    bench.takes = "3.5"
    bench.clients[0].change("gain [1/s]", 4.0)
    for client in bench.clients:
        bench.until(lambda: client.gui[client.find("gain [1/s]")].get("value") == 3.5)  # noqa: B023


def test_the_pad_drives_while_it_is_pressed(bench):
    until_it_may_drive(bench)
    for other in ("up", b"ahead", "", 60_000 * "x"):
        bench.clients[0].hold(other)
    bench.run(6)
    assert not bench.driven.drain() and "no page has control" in bench.content
    for _ in range(4):
        bench.clients[0].hold("ahead")
        bench.clients[1].hold("back")
        bench.run(2)
    xs = [message.fields["linear"]["x"] for message in bench.driven.drain()]
    assert len(xs) >= 4 and set(xs) == {0.1}
    bench.run(12)
    xs = [message.fields["linear"]["x"] for message in bench.driven.drain()]
    assert xs[-1] == 0.0 and xs.count(0.0) == 1


@pytest.mark.parametrize("way", ["silent", "closed", "half closed", "without its life"])
def test_a_page_that_is_silent_or_closed_commands_no_more(bench, way):
    """Whatever way a page ends, base and hand get a last command at rest within 0.7 s, and control is free again."""
    until_it_may_drive(bench)
    command(bench)
    client = bench.clients[0]
    client.send(DRAG)
    client.hold("ahead")
    bench.run(5)
    assert bench.moved.drain() and bench.driven.drain()
    if way == "closed":
        client.close()
        bench.clients.pop(0)
    elif way == "half closed":
        client._connection.socket.shutdown(socket.SHUT_WR)
        bench.clients.pop(0)
    elif way == "without its life":
        client._life.close()
    client.is_alive = False
    since = bench.bus.time
    bench.until(lambda: "no page has control" in bench.content)
    assert bench.bus.time - since < 0.7
    rest = bench.moved.drain()[-1].values
    assert_allclose(rest, [0.5, 0.2, 0.3, *Rotation.from_euler("z", 0.3).as_quat()], atol=1e-9)
    assert bench.driven.drain()[-1].fields["linear"]["x"] == 0.0
    bench.run(10)
    assert not bench.moved.drain() and not bench.driven.drain()
    bench.clients[-1].click("take control")
    bench.until(lambda: "no page has control" not in bench.content)


def test_a_page_that_reloads_commands_no_more(bench):
    """Also within a second, eight times: what it pressed ends, and others may command."""
    until_it_may_drive(bench)
    for _ in range(8):
        with opened_page(bench.server.address) as client:
            bench.clients.insert(0, client)
            bench.until(lambda: client.is_known and "ahead" in bench.content)  # noqa: B023
            client.hold("ahead")
            bench.run(2)
        bench.clients.pop(0)
    bench.until(lambda: "no page has control" in bench.content)
    bench.run(4)
    assert bench.driven.drain()[-1].fields["linear"]["x"] == 0.0
    command(bench)


def test_a_reference_is_dragged_in_the_frame_of_its_task(bench):
    """Only the page in control drags; the reference is sent relative to the torso until the drag ends."""
    client, other = bench.clients
    command(bench)
    other.send(DRAG)
    bench.run(6)
    assert not bench.moved.drain()
    client.send(DRAG)
    bench.run(30)  # it is dragged as long as the page answers, also where it does not move
    messages = bench.moved.drain()
    assert len(messages) > 20
    torso = bench.state.measured["torso_2"]
    assert_allclose(messages[-1].values[:3], torso.rotation.T @ ((0.6, 0.1, 0.4) - torso.position), atol=1e-9)
    rotation = Rotation.from_quat(messages[-1].values[3:]).as_matrix()
    assert_allclose(torso.rotation @ rotation, np.eye(3), atol=1e-9)
    client.send(_messages.TransformControlsDragEndMessage("/drag/hands/left"))
    bench.run(4)
    bench.moved.drain()
    bench.run(6)
    assert not bench.moved.drain()


def value(client, label):
    return client.gui[client.find(label)]["value"]


def test_a_page_without_control_changes_nothing_of_others(bench):
    """Inputs and handles that all pages share keep what they have, and the page shows that again."""
    client, other = bench.clients
    until_it_may_drive(bench)
    command(bench)
    for label, number in (("speed [m/s]", 0.4), ("gain [1/s]", 5.0)):
        before = value(client, label)
        other.gui[other.find(label)]["value"] = number
        other.change(label, number)
        bench.until(lambda: value(other, label) == before)  # noqa: B023
        assert value(client, label) == before
    other.positions.pop("/drag/hands/left", None)
    before = client.positions.get("/drag/hands/left")
    message = _messages.TransformControlsUpdateMessage("/drag/hands/left", (1.0, 0.0, 0.0, 0.0), (0.9, 0.1, 0.4))
    other.send(message)
    bench.until(lambda: "/drag/hands/left" in other.positions)
    assert client.positions.get("/drag/hands/left") == before
    assert_allclose(other.positions["/drag/hands/left"], bench.state.references[0].reference.position, atol=1e-5)
    for label, content in (("life", "abort"), ("life", "stop"), ("base", ""), ("give it back", True)):
        other.change(label, content)
    for label in ("EMERGENCY STOP", "speed [m/s]", "life", "give it back"):
        for frequency in (10.0, 0.0, -1.0, 1e308):
            other.send(_messages.GuiButtonHoldMessage(other.find(label), frequency))
    for kind in (_messages.TransformControlsDragStartMessage, _messages.TransformControlsDragEndMessage):
        other.send(kind("/drag/hands/left"))
    client.hold("ahead")
    bench.run(4)
    assert {message.fields["linear"]["x"] for message in bench.driven.drain()} == {0.1}
    assert not bench.asked and not bench.moved.drain()


class Pace:
    """That of a bench, which tests set."""

    def __init__(self):
        self.speed, self.measured = 1.0, 0.5

    def now(self):
        return time.monotonic()


def test_a_simulation_is_paused_pushed_reset_and_slowed_down(repository):
    """By the page with control alone, within the bounds of its sliders; its pace is in the status."""
    pace = Pace()
    bench = PageBench(upper_body(), control=True, simulation=pace)
    pace.call = bench.bus.call
    requests = {"pause": Flag, "reset": ResetRequest, "push": PushRequest}
    for name, kind in requests.items():
        bench.offer(f"simulator/{name}", kind, Answer, lambda request: bench.asked.append(request) or Answer())
    with (
        closing(bench.server),
        opened_page(bench.server.address) as client,
        opened_page(bench.server.address) as other,
    ):
        bench.clients = [client, other]
        bench.until(lambda: "0.50 x real time" in client.content and client.is_known and other.is_known)
        command(bench)
        other.click("pause")
        other.change("speed", 3.0)
        bench.run(6)
        assert not bench.asked and pace.speed == 1.0
        for act in (
            lambda: client.click("pause"),
            lambda: client.click("go on"),
            lambda: client.click("reset"),
            lambda: client.change("force [N]", 1e9) or client.change("push", "left"),
            lambda: client.change("speed", -1.0),
        ):
            act()
            bench.run(6)
        push = PushRequest("torso_2", (0.0, 1000.0, 0.0), (0.0, 0.0, 0.0), 0.2)
        assert bench.asked == [Flag(True), Flag(False), ResetRequest(), push] and pace.speed == 0.1


def test_numbers_of_a_page_stay_in_the_range_of_their_slider(bench):
    """A page is not trusted: numbers beyond the slider are clipped, others and impossible poses are ignored."""
    until_it_may_drive(bench)
    command(bench)
    client = bench.clients[0]
    numbers = {0.5: (1e9, 1e308, 2**62, 2**64 - 1), 0.02: (-0.5, -0.0, 1e-320, -(2**63)), 0.3: (0.3,)}
    numbers[0.1] = (np.nan, np.inf, "1", "1e400", b"1", True, None, [0.3], {"value": 0.3}, msgspec.msgpack.Ext(5, b"1"))
    for number, expected in ((number, expected) for expected, those in numbers.items() for number in those):
        client.change("speed [m/s]", 0.1)
        client.change("speed [m/s]", number)
        client.hold("ahead")
        bench.run(2)
        speeds = [message.fields["linear"]["x"] for message in bench.driven.drain()]
        assert speeds[-1] == pytest.approx(expected), number
    drag = _messages.TransformControlsUpdateMessage
    for place in ((1e308, 0.0, 0.0), (np.nan, 0.0, 0.0), (50.0, 0.0, 0.0)):
        client.send(drag("/drag/hands/left", (1.0, 0.0, 0.0, 0.0), place))
    for quaternion in (
        (0.0, 0.0, 0.0, 0.0),
        (1e308, 1e308, 0.0, 0.0),
        (1e-320, 0.0, 0.0, 0.0),
        (np.nan, 0.0, 0.0, 1.0),
    ):
        client.send(drag("/drag/hands/left", quaternion, (0.6, 0.1, 0.4)))
        bench.run(2)
    bench.run(4)
    assert not bench.moved.drain()


OTHER_VALUES = {
    "base": ("evil", "", "../hands", "hands\0", 60_000 * "x", 0, ["hands"], None),
    "column": ("evil", 0, ["centre of mass/z [m]"], 60_000 * "x", None),
    "life": ("kill", "", "start\0", 0, True, ["abort"]),
    "take control": ("", 0, 1, None, [True], 60_000 * "x"),
    "gain [1/s]": ("4", "nan", [4.0], None, True),
}


def test_values_that_an_input_cannot_have_change_nothing(bench, caplog):
    """Of the page that commands; it drives on."""
    until_it_may_drive(bench)
    command(bench)
    client, other = bench.clients
    for label, values in OTHER_VALUES.items():
        before = client.gui[client.find(label)].get("value")
        for value_ in values:
            client.change(label, value_)
            client.hold("ahead")
            bench.run(2)
        assert bench.driven.drain()[-1].fields["linear"]["x"] == 0.1 and not bench.asked, label
        assert other.gui[other.find(label)].get("value") == before, label
    assert len(caplog.records) < 5 * len(OTHER_VALUES) and "\n" not in "".join(caplog.messages)


def test_messages_for_what_is_removed_change_nothing(bench, caplog):
    """Handles that come and go while they are dragged, and questions that were answered or belong to another page."""
    client, other = bench.clients
    until_it_may_drive(bench)
    command(bench)
    for _ in range(5):
        bench.page._control._handles.pop("/hands/left").remove()
        for kind in (_messages.TransformControlsDragStartMessage, _messages.TransformControlsDragEndMessage):
            client.send(kind("/drag/hands/left"))
        client.send(_messages.TransformControlsUpdateMessage("/drag/gone", (1.0, 0.0, 0.0, 0.0), (0.6, 0.1, 0.4)))
        bench.run(2)
    client.click("EMERGENCY STOP")
    bench.until(lambda: has(bench, "stop the robot now"))
    stop = client.find("stop the robot now")
    other.send(_messages.GuiUpdateMessage(stop, {"value": True}))
    client.click("cancel")
    bench.run(4)
    client.send(_messages.GuiUpdateMessage(stop, {"value": True}))
    bench.run(4)
    assert not bench.asked and not bench.moved.drain() and not caplog.records
    client.click("EMERGENCY STOP")
    bench.run(4)
    client.send(_messages.GuiUpdateMessage([*client.gui][-2], {"value": True}))
    bench.until(lambda: bench.asked == [NoFields()])


@pytest.mark.parametrize("bench", [False], indirect=True)
def test_no_page_takes_the_emergency_stop_away(bench):
    client, other = bench.clients
    button = other.find("EMERGENCY STOP")
    for name, content in (("removed", True), ("update_cb", []), ("is_button", False), ("value", [1])):
        other.send(_messages.GuiUpdateMessage(button, {name: content}))
    other.send(_messages.FileTransferStartUpload(button, "a", "a", "a", part_count=0, size_bytes=0))
    bench.run(4)
    for _ in range(2):  # twice: the second question replaces the first
        client.click("EMERGENCY STOP")
        bench.until(lambda: has(bench, "stop the robot now"))
    bench.run(4)
    client.send(_messages.GuiUpdateMessage([*client.gui][-2], {"value": True}))
    bench.until(lambda: bench.asked == [NoFields()])


def test_newer_numbers_overtake_those_that_wait(bench):
    """A page sends 3000 numbers at once: few of them reach the plugin, the newest last."""
    bench.until(lambda: has(bench, "gain [1/s]"))
    command(bench)
    gains = np.linspace(0.1, 7.0, 3000).tolist()
    for gain in gains:
        bench.clients[0].change("gain [1/s]", gain)
    bench.until(lambda: bench.asked and bench.asked[-1] == SetParameters(("gain",), (str(gains[-1]),)))
    assert len(bench.asked) < 300


def test_a_request_that_fails_is_one_line_and_ends_nothing(bench, caplog):
    """A parameter whose value cannot be sent; the emergency stop behind it is carried out."""

    def fails():
        raise ValueError("no value")

    for _ in range(5):
        bench.page._requests.submit("first", fails)
        bench.run(1)
    assert [each.getMessage() for each in caplog.records] == ["a request of a page failed: ValueError: no value"]
    bench.clients[0].click("EMERGENCY STOP")
    bench.until(lambda: has(bench, "stop the robot now"))
    bench.clients[0].click("stop the robot now")
    bench.until(lambda: bench.asked)


ODD_REPLIES = {
    "fewer_values": {"values": ()},
    "more_names": {"names": ("gain", "other")},
    "another_name": {"names": ("other",)},
    "no_number": {"values": ("[",)},
    "not_a_number": {"values": ("nan",)},
    "null": {"values": ("null",)},
    "text": {"values": ('"a"',)},
    "map": {"values": ('{"a": null}',)},
    "huge": {"values": ("1e308",), "minimums": ("-1e308",), "maximums": ("1e308",)},
    "infinite": {"values": ("1e999",)},
    "beyond": {"values": ("1e9",)},
    "lower_above_upper": {"minimums": ("9",), "maximums": ("1",)},
    "markup": {"names": ("<script>alert(1)</script>",), "descriptions": ("<img src=x onerror=alert(1)>",)},
}


def test_plugins_with_odd_parameters_end_nothing(repository, caplog):
    """First, and in place of good ones: others have their tabs, it moves on, and the stop works."""
    bench = PageBench(upper_body(), control=True, foxglove=True)
    good = bench.parameters
    for kind, fields in ODD_REPLIES.items():
        odd = replace(good, **fields)
        bench.offer(
            f"{kind}/get_parameters", GetParameters, ParametersReply, lambda _, odd=odd: good if bench.is_good else odd
        )
        bench.node.report(kind, Health.GOOD, "<script>", {"<b>": float("nan"), "text": "</table>"})
    with closing(bench.server), opened_page(bench.server.address) as client:
        bench.clients = [client]
        for bench.is_good in (False, True, False):
            for kind in ODD_REPLIES:
                bench.page._parameters.forget(kind)
            bench.run(4)
        before = bench.beat
        bench.run(3)
        assert bench.beat > before and {"hands", *ODD_REPLIES} <= set(client.tabs)
        assert "gain [1/s]" in client.labels and "<script>" not in client.content
        assert sum(props.get("label") == "life" for props in client.gui.values()) == 1 + len(ODD_REPLIES)
        client.click("EMERGENCY STOP")
        bench.until(lambda: has(bench, "stop the robot now"))
        client.click("stop the robot now")
        bench.until(lambda: bench.asked)
    assert len(caplog.records) < 20 * len(ODD_REPLIES)
    assert "\n" not in "".join(each.getMessage() for each in caplog.records)
