"""The page: what is seen of a robot, and what belongs to it."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

from viser._messages import RunJavascriptMessage

from solfer.model.urdf.description import Description
from solfer.transport import Middleware
from solfer.transport.middleware import HealthReport
from solfer_tools.scene import SceneState, ShownWorld
from solfer_tools.view.columns import LiveColumns
from solfer_tools.view.commands.control import ONLY_WATCHES, PageControl
from solfer_tools.view.commands.emergency_stop import EmergencyStopButton, StopActions
from solfer_tools.view.commands.own_view import CAMERA, TARGET, OwnViews
from solfer_tools.view.commands.parameters import KnownParameters
from solfer_tools.view.commands.plugin_tabs import PluginTabs, with_pipes
from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.commands.simulation_controls import PacedSimulation, SimulationControls
from solfer_tools.view.drawing import SceneDrawing
from solfer_tools.view.playback import Playback
from solfer_tools.view.plots import Plots
from solfer_tools.view.server import PageServer
from solfer_tools.view.status_bar import StatusBar, status_of
from solfer_tools.view.time_line import TimeLine

if TYPE_CHECKING:
    from solfer_tools.view.foxglove_server import FoxgloveServer

# On a phone viser's panel covers the right half of the picture. This puts it below the picture, as wide as the page;
# viser gives its parts no names, so that they are found by their own styles (BottomPanel.tsx).
_SHEET = """
document.getElementById("solfer-sheet")?.remove();
const sheet = document.createElement("style");
sheet.id = "solfer-sheet";
const panel = '[style*="min-height: 3.5em"]';
sheet.textContent = `@media (max-width: 36em) {
  div:has(> ${panel}) { flex-direction: column; }
  div:has(> ${panel}) > div:not(${panel}) { width: 100%; height: 0 !important; }
  ${panel} { position: relative !important; order: 1; flex: none; width: 100% !important; max-height: 52% !important; }
  ${panel} [style="width: 20em;"] { width: 100% !important; }
}`;
document.head.appendChild(sheet);
"""


class Page:
    """A page of one robot; `update` is called by one loop, which does all that pages request.

    Args:
        server: Serves it.
        description: The robot.
        middleware: Carries what belongs to it.
        stop: The emergency stop; None: the service of the lower level.
        control: Whether pages may command.
        playback: The recording that is shown; None: what is shown is live.
        simulation: The simulation in this process; None: there is none.

    Attributes:
        foxglove: Its server; None: there is none.
    """

    FIELD_OF_VIEW = math.radians(40.0)
    """Vertical field of view [rad]."""

    def __init__(
        self,
        server: PageServer,
        description: Description,
        middleware: Middleware,
        stop: Callable[[], None] | None = None,
        control: bool = False,
        *,
        playback: Playback | None = None,
        simulation: PacedSimulation | None = None,
    ):
        self._viser = server.viser
        self._middleware = middleware
        self._playback = playback
        gui = self._viser.gui
        gui.configure_theme(show_share_button=False, show_logo=False)
        gui.main_panel.dock_right()  # beside the picture, not above it
        self._viser.initial_camera.position = CAMERA
        self._viser.initial_camera.look_at = TARGET
        self._viser.initial_camera.fov = self.FIELD_OF_VIEW
        self._status = StatusBar(server, description.name, simulation)
        server.send(RunJavascriptMessage(_SHEET))
        self._requests = PageRequests(middleware, self._viser)
        self._drawing = SceneDrawing(self._viser.scene, description, ShownWorld(middleware))
        self._views = OwnViews(self._viser, self._requests)
        self._control: PageControl | None = None
        self.foxglove: FoxgloveServer | None = None
        if playback is not None:
            self._time_line = TimeLine(server, self._requests, playback)
            self._plots = Plots(gui, self._requests, playback, incoming=server.incoming)
            return
        self._columns = LiveColumns(middleware)
        self._plots = Plots(gui, self._requests, self._columns, incoming=server.incoming)
        now = middleware.now if simulation is None else simulation.now
        self._control = PageControl(server, self._requests, middleware, now=now) if control else None
        may_command = (lambda _: False) if self._control is None else self._control.may_command
        actions = StopActions.of_lower_level(self._requests)
        if stop is not None:
            actions = StopActions.of_layer(self._requests, stop)
        self._stop = EmergencyStopButton(self._viser, self._requests, actions, may_command=may_command)
        if simulation is not None and control:
            link = self._drawing.base
            SimulationControls(self._viser, self._requests, simulation, may_command=may_command, link=link)
        self._parameters = KnownParameters(middleware)
        self._tabs = PluginTabs(
            gui, self._requests, self._parameters, control=self._control, display=server.incoming.display
        )

    def serve_foxglove(self, server: PageServer) -> None:
        """Let Foxglove get the same as the pages of a server."""
        from solfer_tools.view.foxglove_server import FoxgloveServer  # 54 MB, which most do without

        self.foxglove = FoxgloveServer(
            server, self._requests, self._columns, parameters=self._parameters, control=self._control
        )

    def update(self, state: SceneState | None) -> None:
        """Show a scene; None: nothing new is known."""
        with self._viser.atomic():  # at once: each message beside would wake the thread of the pages
            self._update(state)

    def _update(self, state: SceneState | None) -> None:
        self._requests.update()
        carry_out = self._requests.carry_out
        if self._playback is not None:
            carry_out("the time line", self._time_line.update)
            now = self._playback.time - self._playback.begin
        else:
            reports = dict(self._middleware.reports())
            parts = with_pipes(reports)
            carry_out("the list of parameters", partial(self._parameters.update, parts))
            carry_out("the tabs", partial(self._tabs.update, parts))
            carry_out("the status", partial(self._show_status, reports))
            carry_out("what is plotted", partial(self._columns.update, state, reports))
            now = self._middleware.now()
            if self.foxglove is not None:
                carry_out("the server for Foxglove", partial(self.foxglove.update, state))
        if self._control is not None:
            carry_out("the control", partial(self._control.update, state))
        carry_out("the world", self._drawing.update_world)
        if state is None:
            return
        carry_out("the plot", partial(self._plots.update, now))
        carry_out("the drawing", partial(self._draw, state))
        carry_out("the views", partial(self._views.update, state.measured[self._drawing.base]))

    def _show_status(self, reports: Mapping[str, HealthReport]) -> None:
        status = status_of(reports)
        self._stop.show(bool(status.stop) and self._control is not None)
        state = (lambda _: ONLY_WATCHES) if self._control is None else self._control.state
        self._status.show(status, state, reports)

    def _draw(self, state: SceneState) -> None:
        self._drawing.update(state)
        self._status.beat()
