"""The bar above the picture: state of the robot, control, pace, and the age of all that, which the page itself adds."""

import html
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from viser import GuiHtmlHandle
from viser._messages import RunJavascriptMessage

from solfer.telemetry.statistics import EXECUTOR
from solfer.transport.health import Health
from solfer.transport.lower_level import LOWER_LEVEL
from solfer.transport.middleware import HealthReport
from solfer_tools.view.commands.simulation_controls import PacedSimulation
from solfer_tools.view.server import PageServer

COLORS = {Health.GOOD: "#2b8a3e", Health.WARNING: "#a35200", Health.ERROR: "#c92a2a"}
"""Colours of levels, in which white text can be read."""

SEPARATOR = " | "


@dataclass(frozen=True)
class RobotStatus:
    """How a robot and its plugins are.

    Attributes:
        level: Level of the worst report.
        text: One line about it.
        stop: Why the emergency stop is tripped; empty: it is not.
    """

    level: Health
    text: str
    stop: str = ""


def status_of(reports: Mapping[str, HealthReport]) -> RobotStatus:
    """Return the status that health reports give together, by the names of their parts."""
    for name, report in reports.items():
        # plugins repeat the reason, also when the stop has ended
        if name.rpartition("/")[2] in (LOWER_LEVEL, EXECUTOR) and report.summary.startswith("emergency stop: "):
            return RobotStatus(Health.ERROR, f"STOPPED: {report.summary}", report.summary)
    if not reports:
        return RobotStatus(Health.WARNING, "no plugin reports")
    name, worst = max(reports.items(), key=lambda item: item[1].level)
    if worst.level == Health.GOOD:
        return RobotStatus(Health.GOOD, "running")
    return RobotStatus(worst.level, f"{worst.level.name} {name.rpartition('/')[2]}: {worst.summary}")


class StatusBar:
    """Shows each page its status, and counts its pictures; a script there adds their age while the count stands still.

    Args:
        server: The pages.
        robot: Name of the robot, for the title of the browser's tab.
        simulation: The simulation in this process; None: others know the real-time factor.
    """

    _SCRIPT = """
clearInterval(window.solferWatch);
document.getElementById("solfer-banner")?.remove();
const banner = document.createElement("div");
banner.id = "solfer-banner";
banner.setAttribute("role", "status");
banner.style.cssText = "position:fixed;top:0;z-index:99;padding:0.4em;box-sizing:border-box;color:white;" +
  "font:bold 0.95em sans-serif;text-align:center;pointer-events:none;white-space:pre-wrap";
document.body.appendChild(banner);
document.title = "%s - solfer";
let newest = null, since = performance.now();
window.solferWatch = setInterval(() => {
  const beat = document.getElementById("solfer-beat")?.dataset.count ?? null;
  if (beat !== newest) {
    if (beat !== null) since = performance.now();
    newest = beat;
  }
  const age = (performance.now() - since) / 1000;
  const isOld = age > 0.5;
  const status = document.getElementById("solfer-status");
  const picture = document.querySelector("canvas")?.getBoundingClientRect();
  banner.style.left = `${picture?.left ?? 0}px`;
  banner.style.width = picture ? `${picture.width}px` : "100%%";
  banner.style.background = isOld ? "#d00000" : status?.dataset.color ?? "transparent";
  banner.textContent = (isOld ? `what you see is ${age.toFixed(1)} s old\\n` : "") + (status?.textContent ?? "");
}, 100);
"""

    def __init__(self, server: PageServer, robot: str, simulation: PacedSimulation | None = None):
        self._simulation = simulation
        self._viser = server.viser
        self._count = 0
        self._beat: GuiHtmlHandle = self._viser.gui.add_html(_beat(0))
        self._texts: dict[int, GuiHtmlHandle] = {}
        server.send(RunJavascriptMessage(self._SCRIPT % "".join(filter(str.isprintable, html.escape(robot)))))

    def beat(self) -> None:
        """Note that the page has something new."""
        self._count += 1
        self._beat.content = _beat(self._count)

    def show(self, status: RobotStatus, control: Callable[[int], str], reports: Mapping[str, HealthReport]) -> None:
        """Show each page a status.

        Args:
            status: That of the robot.
            control: Says who has control, by the number of the page that reads it.
            reports: What may know the real-time factor.
        """
        factors = [each.values["real-time factor"] for each in reports.values() if "real-time factor" in each.values]
        factor = float(next(iter(factors), math.nan)) if self._simulation is None else self._simulation.measured
        clients = self._viser.get_clients()
        for gone in set(self._texts) - set(clients):
            del self._texts[gone]
        for number, client in clients.items():
            if number not in self._texts:
                self._texts[number] = client.gui.add_html("")
            parts = [status.text, control(number), "" if math.isnan(factor) else f"{factor:.2f} x real time"]
            text = html.escape(SEPARATOR.join(filter(None, parts)))
            content = f'<span id="solfer-status" data-color="{COLORS[status.level]}" hidden>{text}</span>'
            if self._texts[number].content != content:
                self._texts[number].content = content


def _beat(count: int) -> str:
    return f'<span id="solfer-beat" data-count="{count}"></span>'
