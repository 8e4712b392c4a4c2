"""A person with a phone: the page of a box that drives, in Debian's Chromium of 390 x 844 pixels."""

import os
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.chromium import CHROMIUM, browser  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.middleware.memory import Bus, MemoryMiddleware  # noqa: E402
from solfer.transport import BodyMessage, JointMessage  # noqa: E402
from solfer_tools.scene import LiveScene  # noqa: E402
from solfer_tools.view import Page, PageServer  # noqa: E402

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium")

BOX = """
<robot name="box">
  <link name="base_link">
    <visual><origin xyz="0 0 0.5"/><geometry><box size="0.6 0.4 0.8"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/></material></visual>
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="hand">
    <visual><geometry><sphere radius="0.1"/></geometry></visual>
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="arm" type="revolute">
    <parent link="base_link"/><child link="hand"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
"""
PERIOD = 0.05
RECTANGLE = "(r => [r.x, r.y, r.width, r.height])({}.getBoundingClientRect())"
PANEL = "[...document.querySelectorAll('div')].find(each => each.style.minHeight === '3.5em')"


class DrivenBox:
    """A box that drives as `cmd_vel` says, and its page."""

    def __init__(self):
        self._bus = Bus()
        node = MemoryMiddleware(self._bus, "box")
        self._twist = node.reader("box/cmd_vel", "geometry_msgs/Twist")
        self._base = node.writer("floating_base", "nav_msgs/Odometry")
        self._joints = node.writer("joint_states", "sensor_msgs/JointState")
        robot = Robot.load(BOX, floating_base=True)
        viewer = MemoryMiddleware(self._bus, "view")
        self._scene = LiveScene(robot, viewer)
        self.server = PageServer(0)
        self._page = Page(self.server, robot.description, viewer, control=True)
        self._page._control._pad._speed.value = 0.4
        self.place = np.zeros(2)
        self.heading = 0.0
        self.seen = None

    def cycle(self):
        """Drive and show a period."""
        self._bus.run_until(self._bus.time + PERIOD)
        if self._twist.read() and self._twist.age() < 0.3:
            linear, angular = (self._twist.message.fields[each] for each in ("linear", "angular"))
            self.heading += PERIOD * angular["z"]
            cosine, sine = np.cos(self.heading), np.sin(self.heading)
            self.place += PERIOD * (np.array(((cosine, -sine), (sine, cosine))) @ (linear["x"], linear["y"]))
        turn = np.array((0.0, 0.0, np.sin(0.5 * self.heading), np.cos(0.5 * self.heading)))
        self._base.write(BodyMessage("world", "base_link", np.array((*self.place, 0.0)), turn))
        self._joints.write(JointMessage(("arm",), position=np.zeros(1)))
        self._page.update(self._scene.update())
        time.sleep(PERIOD)

    def drive_in_view(self, key):
        """Press a key for a metre, or a quarter of a revolution; each 0.1 s the whole box is in the picture."""
        begin, before = self.place.copy(), self.heading

        def is_over():
            self.cycle()
            self.seen.check_view(key)
            return np.linalg.norm(self.place - begin) > 1.0 or abs(self.heading - before) > 0.5 * np.pi

        self.seen.ask("Input.dispatchKeyEvent", type="keyDown", key=key, code=f"Key{key.upper()}")
        self.until(is_over, "a base that drives")
        self.seen.ask("Input.dispatchKeyEvent", type="keyUp", key=key, code=f"Key{key.upper()}")

    def close(self):
        """End the page."""
        self.server.close()

    def until(self, script, what, patience=60.0):
        """Let time pass, in lock-step with the browser, until an expression there is true, or a function here."""
        end = time.monotonic() + patience
        while not (self.seen.evaluate(script) if isinstance(script, str) else self.seen.evaluate("true") and script()):
            assert time.monotonic() < end, f"{what}: {self.seen.evaluate('document.body.innerText')}"
            self.cycle()


def test_a_phone_drives_a_robot_that_it_sees(tmp_path):
    """The panel is below the picture, and keys drive the base, which the camera follows."""
    with closing(DrivenBox()) as box, browser(tmp_path, box.server.address, width=390, height=844) as seen:
        box.seen = seen
        canvas = "document.querySelector('canvas')"
        box.until(f"!!window.solferPad && !!({PANEL}) && !!({canvas})", "a page that may command")
        box.until("[...document.querySelectorAll('input')].some(each => each.value === 'box')", "a base to drive")
        # at one time, since both change until all of the page is there; to a pixel, of which browsers lay out fractions
        parts = f"[{RECTANGLE.format(canvas)}, {RECTANGLE.format(PANEL)}]"
        box.until(f"(([picture, panel]) => picture[3] < panel[1] + 1)({parts})", "a panel below the picture")
        (_, top, width, height), (left, _, across, _) = seen.evaluate(parts)
        assert (top, left, width, across) == (0.0, 0.0, 390.0, 390.0) and height > 350.0
        for key in "wqd":
            box.drive_in_view(key)
        assert "you have control" in seen.evaluate("document.body.innerText")
        seen.evaluate("document.querySelectorAll('.mantine-Notification-closeButton').forEach(each => each.click())")
        for _ in range(10):
            box.cycle()
            seen.evaluate("true")
        picture = Path(os.environ.get("PHONE", tmp_path / "phone.png"))
        seen.picture(picture)
        pixels = np.asarray(pytest.importorskip("PIL.Image").open(picture).convert("RGB"), dtype=float)
        rows, columns = np.nonzero(seen_color(pixels[: int(height)]))
        assert len(rows) > 500, "it leaves the picture"
        assert 0.2 * width < columns.mean() < 0.8 * width and 0.2 * height < rows.mean() < 0.8 * height


def seen_color(pixels):
    """Return which pixels have the colour of the box."""
    red, green, blue = np.moveaxis(pixels, 2, 0)
    return (red > 1.5 * green) & (red > 1.5 * blue)
