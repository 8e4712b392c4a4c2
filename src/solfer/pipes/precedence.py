"""Decides which publisher of a topic counts for which DoFs of a measured State, where several publish the same."""

import math

import numpy as np

from solfer.transport.endpoints import PUBLISHER_TIMEOUT


class Owner:
    """A publisher that counts for the DoFs of its messages; one whose messages have other DoFs at times is several.

    Args:
        name: Its name.
        part: Indices of the DoFs in its messages; None: all.
        size: DoFs of the pipe.

    Attributes:
        name, part: See above.
        arrival: Arrival of its newest accepted message, in the pipe's own clock [s].
        dofs: Flags of the DoFs that it publishes and that no newer message of it without the others has, shape (size,).
        lost: Whether some of its DoFs are not among these.
        strikes: Messages of others in a row that arrived after its timeout.
    """

    def __init__(self, name: str, part: np.ndarray | None, size: int):
        self.name = name
        self.part = part
        self.arrival = -math.inf
        self.strikes = 0
        self.dofs = np.zeros(size, dtype=bool)
        self.lost = True


class Watch:
    """Publishers of DoFs of which each has to go on.

    Args:
        dofs: Flags of the DoFs, shape (size,).

    Attributes:
        dofs: See above.
        owners: The publishers; empty: there is only one on the topic.
    """

    def __init__(self, dofs: np.ndarray):
        self.dofs = dofs
        self.owners: tuple[Owner, ...] = ()

    @property
    def stalest(self) -> Owner | None:
        """The one of the `owners` that was silent for longest; None: there are none."""
        stalest = None
        for owner in self.owners:
            if stalest is None or owner.arrival < stalest.arrival:
                stalest = owner
        return stalest


class Precedence:
    """The first publisher of a DoF counts until it times out; messages of others with the same DoFs are ignored.

    A publisher has timed out when at least `strikes` messages of others in a row arrived more than `timeout` [s] after
    its own newest one. Arrivals are compared, not the present time: a loop that reads late finds messages of both.

    Args:
        size: DoFs of the pipe.

    Attributes:
        timeout: See above [s].
        strikes: See above.
        ignored: Messages that were ignored.
        handovers: How often the DoFs of a publisher that had timed out went to another one.
        sole: The only publisher that counts; None: there are several, or none.
    """

    def __init__(self, size: int):
        self.timeout = PUBLISHER_TIMEOUT
        self.strikes = 1
        self.ignored = 0
        self.handovers = 0
        self.sole: Owner | None = None
        self._size = size
        self._watches: list[Watch] = []
        self._owners: dict[tuple[str, int], Owner] = {}  # by name and identity of the part
        self._conflicts: dict[str, tuple[float, tuple[Owner, ...]]] = {}

    def watch(self, watch: Watch) -> None:
        """Keep the publishers of a watch up to date."""
        self._watches.append(watch)
        self._arrange()

    def admits(self, name: str, part: np.ndarray | None, arrival: float) -> bool:
        """Decide whether a message of a publisher with the DoFs `part` that arrived at `arrival` [s] counts.

        DoFs of a publisher that has timed out are free from then on.
        """
        owners = self._owners_of(name, part)
        if not owners:
            return True
        if all([self._outlasts(owner, arrival) for owner in owners]):
            for owner in owners:
                del self._owners[owner.name, id(owner.part)]
            self.handovers += 1
            return True
        self.ignored += 1
        if name not in self._conflicts:
            self._forget(arrival - PUBLISHER_TIMEOUT)
        self._conflicts[name] = arrival, owners
        return False

    def note(self, name: str, part: np.ndarray | None, arrival: float) -> None:
        """Record an accepted message; see `admits`."""
        key = name, id(part)
        owner = self._owners.get(key)
        if owner is None:
            owner = self._owners[key] = Owner(name, part, self._size)
        owner.arrival = arrival
        owner.strikes = 0
        if owner.lost:
            self._take(owner)
            self._arrange()

    def conflicting_publishers(self, since: float) -> list[str]:
        """List the publishers of the same DoFs since a time [s], sorted; empty: there are none."""
        self._forget(since)
        names = set()
        for name, (_, owners) in self._conflicts.items():
            present = {owner.name for owner in owners if owner.arrival >= since}
            if present:
                names |= {name, *present}
        return sorted(names)

    def _take(self, owner: Owner) -> None:
        """Let an owner have all of its DoFs, and no other owner of its publisher any of them."""
        selected = slice(None) if owner.part is None else owner.part
        for key, other in list(self._owners.items()):
            if other.name == owner.name and other.dofs[selected].any():
                other.dofs[selected] = False
                other.lost = True
                if other is not owner and not other.dofs.any():
                    del self._owners[key]
        owner.dofs[selected] = True
        owner.lost = False

    def _arrange(self) -> None:
        """Find out which publisher is the only one, or which of several each watch has."""
        owners = tuple(self._owners.values())
        self.sole = owners[0] if len(owners) == 1 else None
        several = len(owners) > 1
        for watch in self._watches:
            watch.owners = tuple(owner for owner in owners if several and (owner.dofs & watch.dofs).any())

    def _owners_of(self, name: str, part: np.ndarray | None) -> tuple[Owner, ...]:
        """Return other publishers of some of these DoFs."""
        selected = slice(None) if part is None else part
        return tuple(owner for owner in self._owners.values() if owner.name != name and owner.dofs[selected].any())

    def _outlasts(self, owner: Owner, arrival: float) -> bool:
        """Return whether an owner has timed out when a message of another publisher arrived at `arrival` [s]."""
        if arrival - owner.arrival <= self.timeout:
            owner.strikes = 0
            return False
        owner.strikes += 1
        return owner.strikes >= self.strikes

    def _forget(self, since: float) -> None:
        """Drop conflicts without an ignored message since a time [s]."""
        for name, (arrival, _) in list(self._conflicts.items()):
            if arrival < since:
                del self._conflicts[name]
