"""Who may command which joints: leases that end when their owner falls silent."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from solfer.errors import ClaimRefused, Suspended
from solfer.pipes.messages import JOINT_FIELDS

FREE = -1
MODES = {field: row for row, field in enumerate(JOINT_FIELDS)}
SHOWN = 6  # joints in an error


class Wanted(NamedTuple):
    """Joints of a controller, by their indices in it, and fields of its command."""

    controller: str
    indices: np.ndarray
    modes: tuple[str, ...]


class Ended(NamedTuple):
    """A lease that ended: whose, and for each controller which of its joints it had, shape (joints,)."""

    owner: str
    joints: dict[str, np.ndarray]


class Claims:
    """Leases on joints and fields of their commands, in the time of the lower level.

    Every accepted command renews all that its sender has. A sender without a lease gets one on what it commands, where
    that is free. A sender that is barred (its claims are void) has to claim by `claim`, or to be silent for a lease.

    Args:
        joints: Names of the joints of each controller.
        lease: Time after an owner's last message at which its lease ends [s].
    """

    def __init__(self, joints: Mapping[str, Sequence[str]], lease: float):
        self._joints, self._lease = dict(joints), lease
        self._owners = {name: np.full((len(MODES), len(items)), FREE) for name, items in joints.items()}
        self._ids: dict[str, int] = {}
        self._ages: dict[int, float] = {}
        self._numbers = itertools.count()
        self._barred: dict[str, list] = {}  # [reason, age]
        self._known: dict[tuple[str, str], tuple[tuple[str, ...], tuple[str, ...]]] = {}

    def renew(self, sender: str, controller: str, names: tuple[str, ...], modes: tuple[str, ...]) -> bool:
        """Renew the lease of a sender that commands the same as in its last `take`; False if it does not.

        Nothing is compared joint by joint, nothing is allocated.
        """
        if self._known.get((sender, controller)) != (names, modes):
            return False
        self._ages[self._ids[sender]] = 0.0
        return True

    def take(self, sender: str, names: tuple[str, ...], wanted: Wanted) -> None:
        """Grant the command of a sender: what it has already, and what is free.

        Raises:
            ClaimRefused: Another one has a joint; nothing was granted.
            Suspended: The claims of this sender are void.
        """
        barred = self._barred.get(sender)
        if barred is not None:
            barred[1] = min(barred[1], 0.0)
            raise Suspended(f"commands of '{sender}' are not accepted: {barred[0]}",
                            expected=f"a new claim, or {self._lease:g} s without a command")
        self._grant(sender, (wanted,))
        self._known[sender, wanted.controller] = (names, wanted.modes)

    def claim(self, owner: str, wanted: Sequence[Wanted]) -> None:
        """Give joints to an owner, all or none.

        Raises:
            ClaimRefused: Another one has a joint; nothing was granted.
        """
        self._grant(owner, wanted)
        self._barred.pop(owner, None)

    def release(self, owner: str) -> Ended:
        """End the lease of an owner, who may have none."""
        number = self._ids.pop(owner, None)
        had: dict[str, np.ndarray] = {}
        if number is None:
            return Ended(owner, had)
        del self._ages[number]
        for controller, owners in self._owners.items():
            mine = owners == number
            if mine.any():
                had[controller] = mine.any(axis=0)
                owners[mine] = FREE
        self._forget(owner)
        return Ended(owner, had)

    def bar(self, owner: str, reason: str, for_ever: bool = False) -> None:
        """Refuse the commands of `owner` until it claims, or, unless `for_ever`, until it was silent for a lease."""
        self._barred[owner] = [reason, -np.inf if for_ever else 0.0]

    def clear(self, controller: str) -> None:
        """End all claims on a controller."""
        self._owners[controller][:] = FREE
        for key in [key for key in self._known if key[1] == controller]:
            del self._known[key]

    def advance(self, dt: float) -> Iterable[Ended]:
        """Let `dt` [s] pass; returns the leases that ended."""
        late = False
        for number, age in self._ages.items():
            self._ages[number] = age + dt
            late = late or age + dt > self._lease
        if self._barred:
            self._unbar(dt)
        if not late:
            return ()
        return [self.release(owner) for owner in self.owners() if self._ages[self._ids[owner]] > self._lease]

    def owners(self) -> tuple[str, ...]:
        """Who has a lease."""
        return tuple(self._ids)

    def describe(self, controller: str) -> str:
        """Who commands what of a controller, such as '/joint_states: position, effort'; empty: nobody."""
        owners = self._owners[controller]
        parts = []
        for owner, number in self._ids.items():
            modes = [mode for mode, row in MODES.items() if (owners[row] == number).any()]
            if modes:
                parts.append(f"{owner}: {', '.join(modes)}")
        return "; ".join(parts)

    def _grant(self, owner: str, wanted: Sequence[Wanted]) -> None:
        mine = self._ids.get(owner, FREE)
        for item in wanted:
            owners = self._owners[item.controller]
            for mode in item.modes:
                present = owners[MODES[mode], item.indices]
                if ((present != mine) & (present != FREE)).any():
                    self._refuse(owner, mine, item)
        if mine == FREE:
            mine = self._ids[owner] = next(self._numbers)
        for item in wanted:
            for mode in item.modes:
                self._owners[item.controller][MODES[mode], item.indices] = mine
        self._ages[mine] = 0.0

    def _refuse(self, owner: str, mine: int, item: Wanted) -> None:
        rows = [MODES[mode] for mode in item.modes]
        present = self._owners[item.controller][np.ix_(rows, item.indices)]
        taken = (present != mine) & (present != FREE)
        names = {number: name for name, number in self._ids.items()}
        others = ", ".join(f"'{names[number]}'" for number in dict.fromkeys(present[taken].tolist()))
        joints = [self._joints[item.controller][index] for index in item.indices[taken.any(axis=0)]]
        shown = ", ".join(joints[:SHOWN]) + (f" and {len(joints) - SHOWN} more" if len(joints) > SHOWN else "")
        raise ClaimRefused(f"'{owner}' cannot command {shown} of controller '{item.controller}': {others} does",
                           expected=f"joints that are free: {others} has to end or to be silent for {self._lease:g} s")

    def _forget(self, owner: str) -> None:
        for key in [key for key in self._known if key[0] == owner]:
            del self._known[key]

    def _unbar(self, dt: float) -> None:
        for owner, entry in list(self._barred.items()):
            entry[1] += dt
            if entry[1] > self._lease:
                del self._barred[owner]
