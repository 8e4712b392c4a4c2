"""A page that drives CENTAURO ends in every way that there is: the robot comes to rest, or does not notice."""

import multiprocessing
import os
import signal
import time
from contextlib import closing

import numpy as np
import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.integration.world import World  # noqa: E402
from support.integration.xbot_system import REPOSITORY, system, until  # noqa: E402
from support.page import drive, opened_page, started_view  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.middleware.memory import MemoryMiddleware  # noqa: E402
from solfer_tools.scene import LiveScene  # noqa: E402
from solfer_tools.view import Page, PageServer  # noqa: E402

pytestmark = pytest.mark.slow

PERIOD = 0.05
SPEED = 0.1
"""Of the base while the button is pressed [m/s]."""

WHEEL = SPEED / 0.078
"""Of a wheel then [rad/s]."""


class DrivenPage:
    """CENTAURO in memory at the pace of the clock, its page, and a page in a process of its own that drives it."""

    def __init__(self):
        self.world = World()
        for name, target in (("odometry", "solfer.components.odometry:Odometry"), ("wheeled_motion", None)):
            plugin = self.world.plugin(name, target=target)
        node = MemoryMiddleware(self.world.bus, "view")
        self.scene = LiveScene(Robot.load(plugin.robot.description.text), node)
        self.server = PageServer(0)
        self.page = Page(self.server, plugin.robot.description, node, control=True)
        self._commands = MemoryMiddleware(self.world.bus, "test").queue("wheeled_motion/cmd_vel", "geometry_msgs/Twist")
        self.command = 0.0
        self.driver = None
        self.run(1.5)

    def drive(self):
        """Let a page drive, if none does."""
        if self.driver is None or not self.driver.is_alive():
            self.driver = driver(self.server.address)
        end = time.monotonic() + 60.0
        while self.speed() < 0.8 * SPEED:
            assert time.monotonic() < end, "it does not drive"

    def run(self, duration):
        """Let time pass on the bus, no faster than by the clock."""
        for _ in range(round(duration / PERIOD)):
            end = time.monotonic() + PERIOD
            self.world.run(PERIOD)
            self.page.update(self.scene.update())
            for message in self._commands.drain():
                self.command = message.fields["linear"]["x"]
            time.sleep(max(end - time.monotonic(), 0.0))

    def speed(self, duration=0.2):
        """Return the speed of the base over a time [m/s]."""
        before = self.world.simulation.q[:2].copy()
        self.run(duration)
        return float(np.linalg.norm(self.world.simulation.q[:2] - before)) / duration

    def close(self):
        end(self.driver)
        self.server.close()
        self.world.close()


def driver(address):
    """Start a page that drives in a process of its own."""
    process = multiprocessing.get_context("spawn").Process(target=drive, args=(address,), daemon=True)
    process.start()
    return process


def end(process):
    """Kill a process, and wait until it has ended."""
    if process is not None:
        process.kill()
        process.join()


@pytest.fixture(scope="module")
def driven():
    with closing(DrivenPage()) as made:
        yield made


def test_others_neither_command_nor_stop_it(driven):
    """A second page, a wrong token and a foreign origin: it drives on."""
    driven.drive()
    with opened_page(driven.server.address) as other:
        for _ in range(100):
            driven.run(PERIOD)
            other.receive(0.01)
            if other.is_known and "take control" in other.labels:
                break
        other.receive(0.2)
        other.click("take control")
        other.hold("back")
        for _ in range(20):
            driven.run(PERIOD)
            other.receive(0.01)
        assert any("has control since" in note for note in other.notes)
    for address, origin in ((driven.server.address, "http://evil.example"), (driven.server.address[:-2], None)):
        with pytest.raises(InvalidStatus), opened_page(address, origin):
            pass
    assert driven.command == SPEED and driven.speed() > 0.8 * SPEED


@pytest.mark.parametrize("way", [signal.SIGSTOP, signal.SIGKILL])
def test_a_page_that_hangs_or_dies_is_at_zero_in_time(driven, way):
    """The page's process stands still and goes on, then it is killed, with its connections."""
    driven.drive()
    os.kill(driven.driver.pid, way)
    driven.run(0.6)
    assert driven.command == 0.0
    driven.run(1.0)
    assert driven.speed() < 0.01
    if way == signal.SIGSTOP:
        os.kill(driven.driver.pid, signal.SIGCONT)
        driven.run(1.0)
        assert driven.command == 0.0  # it presses on, without control
    end(driven.driver)


def test_a_robot_rests_when_the_process_of_its_page_is_killed(tmp_path):
    """In a real-time layer no velocity comes any more, and no zero: the plugin itself brakes, 0.55 s later."""
    file = tmp_path / "layer.yaml"
    file.write_text(f"""
XBotRTPlugins: {{plugins: ["odometry3::odometry", wheeled_motion]}}
mwoibn: {{config_file: {REPOSITORY / "config/centauro.yaml"}}}
executor: {{rate: 200, start: [odometry, wheeled_motion], blend: 0.2}}
""")
    with system() as layer:
        layer.simulate()
        layer.start(REPOSITORY / "nodes" / "xbot", str(file), "--namespace", layer.name)
        with started_view("--namespace", layer.name, "--control") as (process, address):
            page = driver(address)
            try:
                until(lambda: layer.speed() > 0.5 * WHEEL, "wheels that turn")
                layer.watch(0.5)
                process.kill()
                killed = layer.samples[-1][0]
                layer.watch(3.0)
            finally:
                end(page)
        assert 0.0 < layer.rest_after(killed) < 1.5
