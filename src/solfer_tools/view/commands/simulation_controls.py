"""What a page does to the simulation in its own process: pause, reset, speed, push."""

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, Protocol

from viser import GuiEvent, ViserServer

from solfer.transport.lower_level import Answer
from solfer_tools.view.commands.requests import PageRequests

PUSH_TIME = 0.2
"""How long a push acts [s]."""

AXES = {"ahead": (1.0, 0.0), "back": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)}
"""Directions of a push in the axes of the world, which the robot has at the start."""


class PacedSimulation(Protocol):
    """A simulation in memory, and how fast it goes on.

    Attributes:
        speed: Simulated seconds that are requested for each second.
        measured: Those of the newest second; NaN: it is not over.
    """

    speed: float
    measured: float

    def now(self) -> float:
        """Return the time of the person at the page [s], from any thread."""

    def call(self, name: str, **fields: Any) -> Future[Any]:
        """Call a service with a request of fields."""


class SimulationControls:
    """Buttons for the page with control.

    Args:
        viser: The pages.
        requests: Carries out what they request.
        simulation: The simulation.
        may_command: Whether a page may use them.
        link: What is pushed.
    """

    def __init__(
        self,
        viser: ViserServer,
        requests: PageRequests,
        simulation: PacedSimulation,
        *,
        may_command: Callable[[int | None], bool],
        link: str,
    ):
        self._requests = requests
        self._simulation = simulation
        self._may_command = may_command
        self._link = link
        self._is_paused = False
        gui = viser.gui
        with gui.add_folder("simulation", expand_by_default=False):
            self._pause = gui.add_button("pause")
            reset = gui.add_button("reset", hint="puts the robot into its start")
            speed = gui.add_slider("speed", 0.1, 4.0, 0.1, 1.0, hint="simulated seconds for each second")
            self._force = gui.add_slider("force [N]", 10.0, 1000.0, 10.0, 200.0, hint=f"of a push of {PUSH_TIME} s")
            push = gui.add_button_group("push", tuple(AXES))

        for button, work in ((self._pause, self._toggle), (reset, self._reset)):
            button.on_click(partial(self._submit, work))
        push.on_click(partial(self._submit, lambda: self._push(push.value)))

        @speed.on_update
        async def _(_: object) -> None:
            simulation.speed = float(speed.value)

    async def _submit(self, work: Callable[[], None], event: GuiEvent) -> None:  # type: ignore[type-arg]
        self._requests.submit(("simulation", event.client_id), partial(self._carry_out, event.client_id, work))

    def _carry_out(self, client: int | None, work: Callable[[], None]) -> None:
        if self._may_command(client):
            work()

    def _toggle(self) -> None:
        is_paused = not self._is_paused
        self._call("pause", partial(self._note, is_paused), data=is_paused)

    def _note(self, is_paused: bool, reply: Answer | None) -> None:
        if reply is not None:
            self._is_paused = is_paused
            self._pause.label = "go on" if is_paused else "pause"

    def _reset(self) -> None:
        self._call("reset", lambda _: None)

    def _push(self, direction: str) -> None:
        x, y = (float(self._force.value) * each for each in AXES[direction])
        self._call("push", lambda _: None, link=self._link, force=(x, y, 0.0), duration=PUSH_TIME)

    def _call(self, name: str, done: Callable[[Answer | None], None], **fields: Any) -> None:
        service = f"simulator/{name}"
        self._requests.follow(self._simulation.call(service, **fields), service, done)
