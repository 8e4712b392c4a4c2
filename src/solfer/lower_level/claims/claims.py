"""Leases on joints, which end when their owner sends no more commands."""

import itertools
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from solfer.errors import ClaimRefused, Suspended
from solfer.transport.lower_level import node_of
from solfer.transport.messages import JOINT_FIELDS

UNCLAIMED = -1
"""Number of the owner of a free joint."""

MODES = {field: row for row, field in enumerate(JOINT_FIELDS)}
"""Row of each field of a command."""

BARRED = 256
"""Most senders that are barred by name; beyond that every sender without a claim is barred."""


class ClaimedJoints(NamedTuple):
    """Joints of a controller, by their indices in it, and fields of its command."""

    controller: str
    indices: np.ndarray
    modes: tuple[str, ...]


class LeaseEnded(NamedTuple):
    """A lease that ended.

    Attributes:
        owner: Its owner.
        joints: For each controller, a mask of the joints that it had, shape (joints,).
        claimed: Whether the owner had requested it by `claim` and commanded since, and not just commanded free joints.
    """

    owner: str
    joints: dict[str, np.ndarray]
    claimed: bool


class Claims:
    """Leases on joints and fields of their commands, in the time of the lower level.

    Owners and senders are claimants: nodes, or components of a node, each with a lease of its own. Every accepted
    command renews the whole lease of its sender. A sender without a lease gets one on the joints that it commands, if
    they are free. A barred sender (its claims are void) has to claim by `claim`; time alone ends no bar, since a
    process that stood still goes on with commands of long ago.

    Args:
        joints: Names of the joints of each controller.
        lease: Time after an owner's last message at which its lease ends [s].
    """

    def __init__(self, joints: Mapping[str, Sequence[str]], lease: float):
        self._joints = dict(joints)
        self._lease = lease
        self._owners = {name: np.full((len(MODES), len(items)), UNCLAIMED) for name, items in joints.items()}
        self._ids: dict[str, int] = {}
        self._nodes: Counter[str] = Counter()  # how many owners each node has
        self._ages: dict[int, float] = {}
        self._numbers = itertools.count()
        self._barred: dict[str, str] = {}  # reasons
        self._claimed: dict[str, bool] = {}  # whether they have commanded since
        self._crowd = ""  # why every sender without a claim is barred
        self._known: dict[tuple[str, str], tuple[tuple[str, ...], tuple[str, ...]]] = {}

    def renew(self, sender: str, controller: str, names: tuple[str, ...], modes: tuple[str, ...]) -> bool:
        """Renew the lease of a sender that commands the same as in its last `claim_by_command`; False if it does not.

        Compares nothing joint by joint, and allocates nothing.
        """
        if self._known.get((sender, controller)) != (names, modes):
            return False
        self._ages[self._ids[sender]] = 0.0
        return True

    def claim_by_command(self, sender: str, names: tuple[str, ...], requested: ClaimedJoints) -> None:
        """Grant a sender the joints that it commands, as far as it has them already or they are free.

        Raises:
            ClaimRefused: Another owner has a joint; nothing was granted.
            Suspended: The claims of this sender are void.
        """
        reason = self._barred.get(sender) or (sender not in self._ids and sender and self._crowd)
        if reason:
            raise Suspended(
                f"commands of '{sender}' are not accepted: {reason}",
                expected="a new claim by lower_level/claim, which starts from the measured state",
            )
        self._grant(sender, (requested,))
        if sender in self._claimed:
            self._claimed[sender] = True
        self._known[sender, requested.controller] = (names, requested.modes)

    def claim(self, owner: str, requested: Sequence[ClaimedJoints]) -> None:
        """Grant joints to an owner, all or none.

        Raises:
            ClaimRefused: Another owner has a joint; nothing was granted.
        """
        self._grant(owner, requested)
        self._claimed[owner] = False
        self._forget(owner)
        self._barred.pop(owner, None)

    def release(self, owner: str) -> LeaseEnded:
        """End the lease of an owner, if it has one."""
        number = self._ids.pop(owner, None)
        had: dict[str, np.ndarray] = {}
        claimed = self._claimed.pop(owner, False)
        if number is None:
            return LeaseEnded(owner, had, claimed)
        del self._ages[number]
        node = node_of(owner)
        self._nodes[node] -= 1
        if not self._nodes[node]:
            del self._nodes[node]
        for controller, owners in self._owners.items():
            mine = owners == number
            if mine.any():
                had[controller] = mine.any(axis=0)
                owners[mine] = UNCLAIMED
        self._forget(owner)
        return LeaseEnded(owner, had, claimed)

    def knows(self, owner: str) -> bool:
        """Return whether an owner has commanded before, or is barred."""
        return owner in self._barred or self._claimed.get(owner, False)

    def bar(self, owner: str, reason: str) -> None:
        """Refuse the commands of `owner` until it claims; without a name it is part of this process, and exempt."""
        if not owner:
            return
        if len(self._barred) >= BARRED and owner not in self._barred:
            self._crowd = f"{reason} ({BARRED} senders are barred, so that every sender has to claim)"
            return
        self._barred[owner] = reason

    def clear(self, controller: str) -> None:
        """End all claims on a controller."""
        self._owners[controller][:] = UNCLAIMED
        for key in [key for key in self._known if key[1] == controller]:
            del self._known[key]

    def advance(self, dt: float) -> Iterable[LeaseEnded]:
        """Let `dt` [s] pass; return the leases that ended."""
        late = False
        for number, age in self._ages.items():
            self._ages[number] = age + dt
            late = late or age + dt > self._lease
        if not late:
            return ()
        return [self.release(owner) for owner in self.owners() if self._ages[self._ids[owner]] > self._lease]

    @property
    def nodes(self) -> Container[str]:
        """Nodes of the owners of leases, a live view."""
        return self._nodes

    def owners(self) -> tuple[str, ...]:
        """Return the owners of leases."""
        return tuple(self._ids)

    def unclaimed(self, controller: str, mode: str, indices: np.ndarray) -> np.ndarray:
        """Select those of a controller's joints at `indices` whose field `mode` is not claimed."""
        return indices[self._owners[controller][MODES[mode], indices] == UNCLAIMED]

    def describe(self, controller: str) -> str:
        """Describe the owners of a controller, such as '/joint_states: position, effort'; empty: it is free."""
        owners = self._owners[controller]
        parts = []
        for owner, number in self._ids.items():
            modes = [mode for mode, row in MODES.items() if (owners[row] == number).any()]
            if modes:
                parts.append(f"{owner}: {', '.join(modes)}")
        return "; ".join(parts)

    def _grant(self, owner: str, requested: Sequence[ClaimedJoints]) -> None:
        mine = self._ids.get(owner, UNCLAIMED)
        for item in requested:
            owners = self._owners[item.controller]
            for mode in item.modes:
                present = owners[MODES[mode], item.indices]
                if ((present != mine) & (present != UNCLAIMED)).any():
                    self._refuse(owner, mine, item)
        if mine == UNCLAIMED:
            mine = self._ids[owner] = next(self._numbers)
            self._nodes[node_of(owner)] += 1
        for item in requested:
            for mode in item.modes:
                self._owners[item.controller][MODES[mode], item.indices] = mine
        self._ages[mine] = 0.0

    def _refuse(self, owner: str, mine: int, item: ClaimedJoints) -> None:
        rows = [MODES[mode] for mode in item.modes]
        present = self._owners[item.controller][np.ix_(np.array(rows), item.indices)]
        taken = (present != mine) & (present != UNCLAIMED)
        names = {number: name for name, number in self._ids.items()}
        others = ", ".join(f"'{names[number]}'" for number in dict.fromkeys(present[taken].tolist()))
        joints = [self._joints[item.controller][index] for index in item.indices[taken.any(axis=0)]]
        listed = 6  # joints that the error names
        shown = ", ".join(joints[:listed]) + (f" and {len(joints) - listed} more" if len(joints) > listed else "")
        raise ClaimRefused(
            f"'{owner}' cannot command {shown} of controller '{item.controller}': {others} does",
            expected=f"joints that are free: {others} has to end or to send nothing for {self._lease:g} s",
        )

    def _forget(self, owner: str) -> None:
        for key in [key for key in self._known if key[0] == owner]:
            del self._known[key]
