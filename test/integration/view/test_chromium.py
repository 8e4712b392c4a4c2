"""A person at the page: Debian's Chromium, by its mouse, on CENTAURO in lock-step with it."""

import os
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.chromium import CHROMIUM, browser, element  # noqa: E402
from support.page import view  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.robot.description.shipped import robot_of  # noqa: E402
from solfer_tools.scene import LiveScene  # noqa: E402
from solfer_tools.study import SimulatedRun, read_study  # noqa: E402
from solfer_tools.view import Page, PageServer  # noqa: E402
from solfer_tools.view.commands.own_view import CAMERA, TARGET  # noqa: E402

pytestmark = [pytest.mark.soak, pytest.mark.skipif(CHROMIUM is None, reason="needs Debian's chromium")]

REPOSITORY = Path(__file__).parents[3]
PICTURE = "SOLFER_PICTURE"
"""Variable with the file of the picture for the docs; not set: none is written."""

STUDY = f"""
configuration: {{file: {REPOSITORY}/config/centauro.yaml}}
plugins: ["odometry3::odometry", wheeled_motion, manipulation]
motion: {{function: "builtins:print"}}
settle: 2.0
duration: 600.0
"""
PERIOD = 0.2
BEATS = "(document.getElementById('solfer-beat')?.dataset.count ?? 0)"
TIDY = """
document.querySelectorAll('.mantine-Notification-closeButton').forEach(each => each.click());
document.getElementById('solfer-banner').style.visibility = 'hidden';
[...document.querySelectorAll('*')].forEach(each => { each.scrollTop = 0; });
"""
"""Hides banners: without a graphics card a screenshot takes seconds, and the browser warns of it."""

HAND = "arm1_7"
GAIN = "stack.tasks.left.gain"


class Shown:
    """A simulated CENTAURO, its page, and a browser in lock-step: the next picture comes when one has been drawn."""

    def __init__(self, folder):
        (folder / "study.yaml").write_text(STUDY)
        self.run = SimulatedRun(read_study(folder / "study.yaml").record)
        self.run.attend()
        _, files = robot_of("centauro")
        robot = Robot.load(files.urdf, files.srdf, files.floating_base, name="centauro", contacts=files.contacts)
        node = self.run.node("view")
        self.scene = LiveScene(robot, node)
        self.server = PageServer(0)
        self.page = Page(self.server, robot.description, node, control=True)
        self.browser = None

    def step(self, duration=PERIOD, period=PERIOD):
        """Let a time pass [s], with a picture each `period`."""
        for _ in range(round(duration / period)):
            self.run.step(period)
            before = self.beats
            self.page.update(self.scene.update())
            end = time.monotonic() + 10.0
            while self.beats == before and time.monotonic() < end:
                time.sleep(0.05)

    @property
    def beats(self):
        """Number of the pictures that the browser has received."""
        return int(self.browser.evaluate(BEATS)) if self.browser else 0

    @property
    def text(self):
        """Text of the page."""
        return self.browser.evaluate("document.body.innerText")

    def until(self, condition, what, patience=90.0):
        """Let time pass until a condition holds."""
        end = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < end, f"{what}\n{self.text}"
            self.step()

    def position(self, link):
        """Return where PyBullet has a link [m]."""
        return self.run.simulation.state.now.position(link).copy()

    def ask(self, service, **fields):
        """Call a service."""
        reply = self.run.bus.call(service, **fields)
        self.step()
        return reply.result(0)

    def gain(self):
        """Return the gain of the left hand's task."""
        reply = self.ask("manipulation/get_parameters")
        return float(dict(zip(reply.names, reply.values, strict=True))[GAIN])

    def canvas(self):
        """Return width and height of the picture [px]."""
        return self.browser.evaluate(
            "(r => [r.width, r.height])(document.querySelector('canvas').getBoundingClientRect())"
        )

    def pixel(self, point):
        """Return the pixel of a point [m] for the first camera, which follows a base that heads ahead."""
        width, height = self.canvas()
        back = np.subtract(CAMERA, TARGET)
        back /= np.linalg.norm(back)
        right = np.cross((0.0, 0.0, 1.0), back)
        right /= np.linalg.norm(right)
        seen = np.array((right, np.cross(back, right), back)) @ (point - CAMERA - (*self.position("pelvis")[:2], 0.0))
        scale = 0.5 * height / np.tan(0.5 * Page.FIELD_OF_VIEW) / -seen[2]
        return 0.5 * width + scale * seen[0], 0.5 * height - scale * seen[1]

    def drive_in_view(self, key):
        """Press a key for a metre, or a quarter of a revolution; each 0.1 s the whole robot is in the picture."""
        begin, before = self.position("pelvis"), self.heading
        code = f"Key{key.upper()}"
        self.browser.ask("Input.dispatchKeyEvent", type="keyDown", key=key, code=code)
        end = time.monotonic() + 180.0
        while np.linalg.norm(self.position("pelvis") - begin) < 1.0 and np.cos(self.heading - before) > 0.0:
            assert time.monotonic() < end, f"it does not drive by {key}: {self.text}"
            self.step(0.1, 0.1)
            self.browser.check_view(key)
        self.browser.ask("Input.dispatchKeyEvent", type="keyUp", key=key, code=code)
        for _ in range(10):
            self.step(0.1, 0.1)
            self.browser.check_view(f"{key}, released")

    @property
    def heading(self):
        """Heading of the base [rad]."""
        axes = self.run.simulation.state.now.rotation("pelvis")
        return np.arctan2(axes[1, 0], axes[0, 0])

    def close(self):
        self.server.close()
        self.run.close()


def slider(label):
    """Return the script of the slider with a label."""
    return (
        f"(e => {{ while (!e.querySelector('[role=slider]')) e = e.parentElement;"
        f" return e.querySelector('[role=slider]'); }})({element(label)})"
    )


def test_a_person_watches_drags_tunes_and_stops(tmp_path):
    """The base drives while its button is pressed, the hand follows its handle, the gain its slider; then all stop."""
    with closing(Shown(tmp_path)) as shown, browser(tmp_path / "profile", shown.server.address) as seen:
        shown.browser = seen
        shown.until(lambda: shown.beats > 3, "a page that is drawn")
        shown.until(lambda: "wheeled_motion" in shown.text, "a base to drive")
        shown.until(lambda: "manipulation" in shown.text, "plugins that report")

        begin = shown.position("pelvis")
        with seen.pressed(seen.place("document.querySelector('[data-solfer-drive=back]')")):
            shown.step(2.0)
        shown.until(lambda: "you have control" in shown.text, "control")
        shown.step(2.0, 0.5)
        rest = shown.position("pelvis")
        assert rest[0] - begin[0] < -0.1 and abs(rest[1] - begin[1]) < 0.01, "the base does not drive back"
        shown.step(0.5, 0.5)
        assert np.linalg.norm(shown.position("pelvis") - rest) < 1e-3, "the base does not rest"

        hand = shown.position(HAND)
        (reference,) = [each for each in shown.scene.update().references if each.task == "left"]
        arrow = reference.reference.position + (0.0, 0.0, 0.15)
        grip = shown.pixel(arrow)
        goal = shown.pixel(arrow + (0.0, 0.0, 0.1))
        seen.mouse("mouseMoved", grip, pressed=False)
        shown.step()
        with seen.pressed(grip):
            for share in (0.25, 0.5, 0.75, 1.0):
                seen.mouse("mouseMoved", tuple(np.add(grip, share * np.subtract(goal, grip))))
                shown.step()
            shown.step(2.0, 0.5)
            moved = shown.position(HAND) - hand
            np.testing.assert_allclose(moved, (0.0, 0.0, 0.1), atol=0.01)
            if PICTURE in os.environ:
                seen.evaluate(TIDY)
                shown.step(3.0 * PERIOD)
                seen.picture(Path(os.environ[PICTURE]))
                seen.evaluate("document.getElementById('solfer-banner').style.visibility = ''")
        shown.step(1.0, 0.5)
        np.testing.assert_allclose(shown.position(HAND) - hand, moved, atol=2e-3)

        before = shown.gain()
        seen.click("manipulation")
        shown.step()
        seen.click("parameters")
        shown.step()
        seen.place(slider(f"{GAIN} [1/s]"))
        seen.evaluate(f"{slider(f'{GAIN} [1/s]')}.focus()")
        for _ in range(20):
            seen.key("ArrowRight")
        shown.step()
        shown.until(lambda: shown.gain() > before, "a gain that is changed")
        shown.step(1.0, 0.5)
        assert shown.gain() == pytest.approx(before + 20 * 40.0 / 400, abs=0.2)

        seen.click("EMERGENCY STOP")
        seen.click("stop the robot now")
        emergency = shown.run.simulation.lower_level.emergency
        shown.until(lambda: emergency.reason, "a robot that is stopped")
        shown.until(lambda: "STOPPED: emergency stop: asked for by service" in shown.text, "the reason")
        shown.run.step(16.0)  # its arms slide over the ground for 13 s
        assert np.abs(shown.run.simulation.v[:6]).max() < 0.01, "the base does not rest"
        command = shown.run.plugins["manipulation"].robot.command.position.copy()
        shown.run.step(0.5)
        assert (shown.run.plugins["manipulation"].robot.command.position == command).all()

        shown.step()
        seen.click("clear the stop")
        seen.click("clear the stop now")
        shown.until(lambda: not emergency.reason, "a stop that is cleared")
        shown.ask("simulator/reset", state="", seed=0, x=0.0, y=0.0, yaw=0.0, height=0.0)
        shown.until(lambda: "running" in shown.text and "STOPPED" not in shown.text, "a robot that runs again")
        shown.step(3.0, 0.5)
        shown.page._control._pad._speed.value = 0.4
        for size, keys in (((1366, 768), "wqa"), ((390, 844), "sed")):
            seen.resize(*size)
            shown.step(5.0 * PERIOD)
            for key in keys:
                shown.drive_in_view(key)


def test_control_is_kept_however_slowly_it_draws(tmp_path):
    """A process at the pace of the clock; without a graphics card the browser draws about one picture a second."""
    commands = "document.body.innerText.includes('you have control')"
    with view("--run", "config/studies/robustness.yaml", "--control") as address:
        with browser(tmp_path / "profile", address) as seen:
            seen.wait(f"{BEATS} > 160")  # shaders are compiled, which stops the page for seconds
            seen.click("take control")
            seen.wait(commands)
            end = time.monotonic() + 10.0
            while time.monotonic() < end:
                assert seen.evaluate(commands)
                time.sleep(0.2)
