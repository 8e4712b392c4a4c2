"""What a course desires of a component, cycle by cycle."""

from collections.abc import Sequence
from concurrent.futures import Future

import numpy as np
from driving_cases.courses import Profile
from driving_cases.scenario import ScenarioProfile

from solfer.components.gravity_compensation import LiftContacts, LiftReply
from solfer.components.wheeled_motion import WheeledMotion
from solfer.errors import ComponentError


class Follower:
    """Lets a component follow a course, which goes on at its pace; wheels are lifted where the course says so.

    Args:
        component: The component.
        profile: The course.
        contacts: Names of the wheels' contacts.
    """

    def __init__(self, component: WheeledMotion, profile: Profile | ScenarioProfile, contacts: Sequence[str]):
        self._references, self._profile, self._contacts = component.references, profile, tuple(contacts)
        self._lift = next(service.handler for service in component.services() if service.name == "lift")
        self._answers: list[Future[LiftReply]] = []
        self._has_begun = False

    def step(self) -> None:
        """Write what is desired in the next cycle.

        Raises:
            ComponentError: A wheel cannot be lifted, or put down.
        """
        references, profile = self._references, self._profile
        if not self._has_begun:
            profile.begin(references)
            self._has_begun = True
        if not references.waits:
            profile.step(references.pace)
            for index in np.flatnonzero(references.lifted == profile.grounded):
                request = LiftContacts((self._contacts[index],), bool(not profile.grounded[index]))
                self._answers.append(self._lift(request))
        for answer in self._answers:
            if answer.done() and not answer.result().success:
                raise ComponentError(answer.result().message, expected="a contact that can change")
        profile.write(references)


def holder(component: WheeledMotion) -> str:
    """Return what holds a component where it is; empty: nothing."""
    joint = component.tasks.descent.last
    return component._guard.why or (f"joint '{component.model.dofs[joint]}' is at its bound" if joint >= 0 else "")
