"""Scenarios: the clock of a course, and the contacts that it changes."""

from collections.abc import Sequence
from concurrent.futures import Future

import numpy as np

from solfer.errors import ComponentError, SolferError
from solfer.interfaces.support import LiftContacts, LiftReply
from solfer.transport import Middleware
from solfer_tools.navigation.course import Course, FollowedPace
from solfer_tools.navigation.lookahead import Lookahead
from solfer_tools.navigation.scenario_motion import ScenarioPositions, ScenarioVelocities
from solfer_tools.scenarios import Player, Scenario
from solfer_tools.scenarios.records import LegRecord


class ContactChanges:
    """Lets contacts be lifted and carry again, one after the other, as a scenario has them.

    Args:
        middleware: Carries the requests.
        service: Name of the service.
        names: Names of the contacts, leg by leg.
        grounded: Which legs of the scenario have contact with the ground, shape (n,); live.
    """

    def __init__(self, middleware: Middleware, service: str, names: Sequence[str], grounded: np.ndarray):
        self._middleware = middleware
        self._service = service
        self._names = tuple(names)
        self._desired = grounded
        self._grounded = grounded.copy()
        self._changing = 0
        self._answer: Future[LiftReply] | None = None

    def awaits(self) -> str:
        """Return what is awaited; empty: nothing.

        Raises:
            ComponentError: A contact cannot be lifted, or cannot carry again.
        """
        if self._answer is None:
            return ""
        if not self._answer.done():
            return f"an answer of {self._service}"
        answer = self._answer.result()
        self._answer = None
        if not answer.success:
            raise ComponentError(f"{self._service} refuses: {answer.message}", expected="a contact that can change")
        self._grounded[self._changing] = not self._grounded[self._changing]
        return self.change()

    def change(self) -> str:
        """Request the first contact that is not as the scenario has it; return what is awaited, empty: nothing."""
        changed = np.flatnonzero(self._grounded != self._desired)
        if not len(changed):
            return ""
        self._changing = int(changed[0])
        request = LiftContacts((self._names[self._changing],), bool(self._grounded[self._changing]))
        self._answer = self._middleware.request(
            self._service, "solfer/LiftContacts", request, reply=LiftReply, timeout=120.0
        )
        return f"an answer of {self._service}"


class ScenarioCourse(Course):
    """Plays a scenario. Its x and y are along and across the heading that the base has at the beginning.

    Its clock runs with the pace that the target publishes on `<target>/pace`: where wheels turn first, or a limit slows
    the motion down, the scenario waits, so that the robot goes the whole way. Before velocities jump it slows down.
    While a contact is to be lifted or to carry again, and while a target that has published its pace is silent,
    everything stands still.

    Args:
        middleware: Carries all of it.
        player: Plays the scenario.
        target: Namespace of topics and service.
        odometry: Topic of the odometry, for the heading at the beginning; empty: it is zero.
        contacts: Names of the contacts, leg by leg, for the service `lift`; without any, steps that claim or release
            legs are refused.
        positions: Whether positions are published, for a target that has pipes for them, and not velocities.

    Raises:
        SolferError: Contacts are needed that have no names, or there are not as many as legs; or positions cannot be
            published.
    """

    has_dialogue = True

    def __init__(
        self,
        middleware: Middleware,
        player: Player,
        target: str,
        odometry: str,
        contacts: Sequence[str] = (),
        *,
        positions: bool = False,
    ):
        self._player = player
        name = f"{target}/" if target else ""
        kind = ScenarioPositions if positions else ScenarioVelocities
        self._motion = kind(middleware, player, name, odometry)
        self._lookahead = Lookahead(player.scenario)
        self._followed = FollowedPace(middleware, f"{name}pace")
        self._changes = ContactChanges(middleware, f"{name}lift", contacts, grounded=player.grounded)
        self._is_held = False
        self._moves = True
        self._pace = 0.0
        self.writers = self._motion.writers
        self.count = len(player.scenario.pattern)
        _require_contacts(player.scenario, contacts)

    def awaits(self) -> str:
        """See `Course.awaits`.

        Raises:
            ComponentError: A contact cannot be lifted, or cannot carry again.
        """
        if missing := self._motion.awaits():
            return missing
        missing = self._followed.awaits()
        self.ratio = 0.0 if missing else self._followed.value
        return self._changes.awaits() or missing

    def step(self, period: float, pace: float) -> bool:
        """See `Course.step`."""
        if pace <= 0.0:
            self.rest()
            return True
        if not self._is_held:
            self._go_on(period * pace * self.ratio)
            self._pace = pace
            self._is_held = bool(self._changes.change())  # what the player has computed waits for the contact
            if self._is_held:
                self.rest()
                return True
        self._is_held = False
        self._motion.publish(self._pace)
        return self._moves or self._motion.arrives(period)

    def _go_on(self, period: float) -> None:
        """Let the clock go on [s]; while it stands still the velocities stay what they are."""
        if period > 0.0:
            self._moves = self._player.step(period)
            self._motion.go_on(period)
            self.max_pace = self._lookahead.max_pace(self._player.elapsed)

    def rest(self) -> None:
        """See `Course.rest`."""
        self._motion.publish(0.0)

    @property
    def number(self) -> int:
        """See `Course.number`."""
        return self._player.number

    @property
    def name(self) -> str:
        """See `Course.name`."""
        return self._player.verb

    @property
    def left(self) -> float:
        """See `Course.left`."""
        return self._player.left


def _require_contacts(scenario: Scenario, contacts: Sequence[str]) -> None:
    changing = [step for step in scenario.pattern if isinstance(step, LegRecord)]
    if changing and not contacts:
        raise SolferError(
            f"a step of the type '{changing[0].type}' needs the names of the contacts",
            where=changing[0].where(),
            expected=f"--contacts with {scenario.legs} names",
        )
    if len(contacts) not in (0, scenario.legs):
        raise SolferError(
            f"{len(contacts)} contacts", where="--contacts", expected=f"{scenario.legs}, one for each leg"
        )
