"""`solfer view --namespace` beside a real-time layer in processes of its own."""

import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.integration.xbot_system import REPOSITORY, system, until  # noqa: E402
from support.page import opened_page, view  # noqa: E402

from solfer.plugins import PluginState  # noqa: E402
from solfer.realtime.emergency_stop import EmergencyStopLatch  # noqa: E402

pytestmark = pytest.mark.slow


def test_a_layer_is_shown_switched_tuned_and_stopped(tmp_path):
    """Its plugins report by their statistics alone, and its services answer the page."""
    file = tmp_path / "layer.yaml"
    file.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {REPOSITORY / "config/centauro.yaml"}}}
executor: {{rate: 100, start: [joint_states], blend: 0.2}}
""")
    with system() as layer:
        layer.simulate()
        layer.start(REPOSITORY / "nodes" / "xbot", str(file), "--namespace", layer.name)
        until(lambda: layer.state() is PluginState.RUNNING, "the plugin")
        with view("--namespace", layer.name, "--control") as address, opened_page(address) as page:
            page.until(lambda: "/measured/pelvis" in page.positions and "RUNNING" in page.content, "robot and plugin")
            page.until(lambda: "joint_states" in page.tabs and "xbotcore" in page.tabs, "tabs")
            page.until(lambda: "link_side_online" in page.content, "pipes, in the tab of their plugin")
            assert not [tab for tab in page.tabs if "feedback" in tab]
            page.until(lambda: any("[rad/s2]" in str(each) for each in page.labels), "parameters")
            assert "GOOD</b> RUNNING" in page.content and "cycles" in page.content
            page.click("take control")
            page.until(lambda: "you have control" in page.content, "control")
            page.change("life", "stop")
            until(lambda: page.receive(0.05) or layer.state() is PluginState.STOPPED, "a plugin that is stopped")
            page.click("EMERGENCY STOP")
            page.until(lambda: "stop the robot now" in page.labels, "the question")
            page.click("stop the robot now")
            latch = EmergencyStopLatch(layer.namespace.folder)
            page.until(lambda: latch.reason.startswith("by the page"), "the emergency stop")
            page.until(lambda: "emergency stop: by the page" in page.content, "the reason")
            page.until(lambda: page.gui[page.find("clear the stop")]["visible"], "a way to clear it")
            page.click("clear the stop")
            page.until(lambda: "clear the stop now" in page.labels, "the question")
            page.click("clear the stop now")
            page.until(lambda: not latch and "STOPPED: emergency" not in page.content, "a stop that is cleared")
