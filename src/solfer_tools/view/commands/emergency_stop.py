"""The button of the emergency stop, which also clears it, each with one question."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Self

from viser import GuiButtonHandle, GuiEvent, ViserServer

from solfer.telemetry.statistics import EXECUTOR
from solfer.transport.lower_level import LOWER_LEVEL, Answer
from solfer.transport.middleware import TRIGGER, NoFields
from solfer_tools.view.commands.requests import PageRequests


@dataclass(frozen=True)
class StopActions:
    """What stops a robot, and what it does then.

    Attributes:
        stop, clear: Stop it, and end that, from the loop of the page.
        stopping, clearing: What the robot will do, for the person who is asked.
    """

    stop: Callable[[], None]
    clear: Callable[[], None]
    stopping: str
    clearing: str

    @classmethod
    def of_lower_level(cls, requests: PageRequests) -> Self:
        """Return those of a lower level, by its services."""
        stop, clear = (
            partial(requests.call, f"{LOWER_LEVEL}/{name}", TRIGGER, NoFields(), Answer)
            for name in ("emergency_stop", "reset_emergency_stop")
        )
        return cls(
            stop,
            clear,
            "Wheels stop at once. Springs and feed-forward torques fade out (in 0.5 s by default), only damping stays: "
            "**the robot sinks to the ground**, slowly, and its legs splay. It stays so until the stop is cleared.",
            "The robot becomes stiff and **holds the posture that it has now**. It does not stand up. Plugins take "
            "their joints again; whatever is sent to them from then on moves the robot.",
        )

    @classmethod
    def of_layer(cls, requests: PageRequests, stop: Callable[[], None]) -> Self:
        """Return those of a real-time layer, whose latch `stop` trips."""
        return cls(
            stop,
            partial(requests.call, f"{EXECUTOR}/estop_clear", TRIGGER, NoFields(), Answer),
            "All plugins of the layer are aborted. **The robot holds its posture with its springs**; wheels stop. "
            "No plugin can be started until the stop is cleared.",
            "The robot holds its posture as before. Plugins can be started again; **none starts by itself**.",
        )


class EmergencyStopButton:
    """Always there, also where nothing else may be commanded.

    Args:
        viser: The page.
        requests: Carries it out.
        actions: What it does.
        may_command: Whether a page may clear the stop.
    """

    def __init__(
        self,
        viser: ViserServer,
        requests: PageRequests,
        actions: StopActions,
        may_command: Callable[[int | None], bool],
    ):
        self._requests = requests
        self._actions = actions
        self._may_command = may_command
        self._button = viser.gui.add_button("EMERGENCY STOP", color="red")
        self._button.on_click(partial(self._confirm, False))
        self._clear = viser.gui.add_button("clear the stop", color="orange", visible=False)
        self._clear.on_click(partial(self._confirm, True))

    def show(self, is_stopped: bool) -> None:
        """Offer to clear the stop while the robot is stopped."""
        self._clear.visible = is_stopped

    async def _confirm(self, clears: bool, event: GuiEvent[GuiButtonHandle]) -> None:
        if event.client is None or (clears and not self._clear.visible):
            return
        for question in tuple(event.client.gui._modal_handle_from_uuid.values()):
            question.close()
        actions = self._actions
        gui = event.client.gui
        with gui.add_modal("clear the emergency stop" if clears else "emergency stop") as modal:
            gui.add_markdown(actions.clearing if clears else actions.stopping)
            label = "clear the stop now" if clears else "stop the robot now"
            confirm = gui.add_button(label, color="orange" if clears else "red")
            cancel = gui.add_button("cancel")

        @confirm.on_click
        async def _(_: object) -> None:
            if clears:
                self._requests.submit("clear", partial(self._clear_for, event.client_id))
            else:
                self._requests.submit("stop", actions.stop)
            modal.close()

        @cancel.on_click
        async def _(_: object) -> None:
            modal.close()

    def _clear_for(self, client: int | None) -> None:
        if self._may_command(client):
            self._actions.clear()
