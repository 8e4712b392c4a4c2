"""The button of the emergency stop, with one question before it stops."""

from collections.abc import Callable
from functools import partial

from viser import GuiButtonHandle, GuiEvent, ViserServer

from solfer.transport.lower_level import LOWER_LEVEL, Answer
from solfer.transport.middleware import TRIGGER, NoFields
from solfer_tools.view.commands.requests import PageRequests


class EmergencyStopButton:
    """Always there, also where nothing else may be commanded.

    Args:
        viser: The page.
        requests: Carries it out.
        stop: Stops, from the loop; None: by the service of the lower level.
    """

    def __init__(self, viser: ViserServer, requests: PageRequests, stop: Callable[[], None] | None = None):
        self._requests = requests
        self._stop = stop or partial(requests.call, f"{LOWER_LEVEL}/emergency_stop", TRIGGER, NoFields(), Answer)
        button = viser.gui.add_button("EMERGENCY STOP", color="red")
        button.on_click(self._confirm)

    async def _confirm(self, event: GuiEvent[GuiButtonHandle]) -> None:
        if event.client is None:
            return
        for question in tuple(event.client.gui._modal_handle_from_uuid.values()):
            question.close()
        with event.client.gui.add_modal("emergency stop") as modal:
            confirm = event.client.gui.add_button("stop the robot now", color="red")
            cancel = event.client.gui.add_button("cancel")

        @confirm.on_click
        async def _(_: object) -> None:
            self._requests.submit("stop", self._stop)
            modal.close()

        @cancel.on_click
        async def _(_: object) -> None:
            modal.close()
