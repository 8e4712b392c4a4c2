"""Maps between DoFs: sorted between two conventions, or selected from a Robot (section 1.1.3 of the paper)."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar

import numpy as np

from solfer.errors import ModelError, SizeMismatch, UnknownName


class BidirectionalMap:
    """Selects and sorts DoFs between a Robot and an outside convention, by name.

    Names that only one side has are not mapped: `to_external` and `to_robot` leave their entries as they are.

    Args:
        name: Name of the map.
        robot_names: Names of the Robot's DoFs, in its order.
        external_names: Names of the DoFs outside, in their order.

    Attributes:
        name: Name of the map.
        robot_names: Names of the Robot's DoFs.
        external: Names outside.
        robot_indices: The Robot's indices of the mapped DoFs, in external order, shape (k,).
        external_indices: Their places outside, increasing, shape (k,).

    Raises:
        ModelError: A name stands twice on one side.
    """

    def __init__(self, name: str, robot_names: Sequence[str], external_names: Sequence[str]):
        self.name = name
        self.robot_names = tuple(robot_names)
        self.external = tuple(external_names)
        place = _places(name, "Robot's DoFs", self.robot_names)
        _places(name, "outside names", self.external)
        pairs = [(place[dof], index) for index, dof in enumerate(self.external) if dof in place]
        self.robot_indices = np.array([robot for robot, _ in pairs], dtype=np.intp)
        self.external_indices = np.array([external for _, external in pairs], dtype=np.intp)
        self._buffer = np.zeros(len(pairs))

    @property
    def size(self) -> int:
        """Number of DoFs outside."""
        return len(self.external)

    @property
    def robot_size(self) -> int:
        """Number of the Robot's DoFs."""
        return len(self.robot_names)

    def to_external(self, values: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write the Robot's `values`, shape (robot_size,), into `out` in the outside order, shape (size,)."""
        values.take(self.robot_indices, out=self._buffer, mode="clip")
        out[self.external_indices] = self._buffer
        return out

    def to_robot(self, values: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write outside `values`, shape (size,), into `out` in the Robot's order, shape (robot_size,)."""
        values.take(self.external_indices, out=self._buffer, mode="clip")
        out[self.robot_indices] = self._buffer
        return out

    def select(self, robot_indices: Sequence[int] | np.ndarray, name: str | None = None) -> "BidirectionalMap":
        """Return the map of some of the Robot's DoFs only: the outside order stays, names of other DoFs drop out."""
        selected = {int(index) for index in robot_indices}
        names = [self.robot_names[index] for index in self.robot_indices if int(index) in selected]
        return BidirectionalMap(self.name if name is None else name, self.robot_names, names)

    def __repr__(self) -> str:
        return f"BidirectionalMap({self.name}: {len(self._buffer)} of {self.robot_size} DoFs, {self.size} outside)"


class UnidirectionalMap:
    """Some of a Robot's DoFs, such as an arm or the wheels.

    Args:
        name: Name of the map.
        robot_names: Names of the Robot's DoFs, in its order.
        members: Names of the selected DoFs; their order is kept.

    Attributes:
        name: Name of the map.
        robot_names: Names of the Robot's DoFs.
        names: Names of the selected DoFs.
        indices: Their indices in the Robot's order, shape (k,).
        mask: Whether a DoF of the Robot is selected, shape (robot_size,).

    Raises:
        ModelError: A name stands twice.
        UnknownName: The Robot has no such DoF.
    """

    def __init__(self, name: str, robot_names: Sequence[str], members: Sequence[str]):
        self.name = name
        self.robot_names = tuple(robot_names)
        self.names = tuple(members)
        place = _places(name, "Robot's DoFs", self.robot_names)
        _places(name, "members", self.names)
        for member in self.names:
            if member not in place:
                raise UnknownName("DoF", member, self.robot_names, where=f"map '{name}'")
        self.indices = np.array([place[member] for member in self.names], dtype=np.intp)
        self.mask = np.zeros(len(self.robot_names), dtype=bool)
        self.mask[self.indices] = True

    @property
    def size(self) -> int:
        """Number of selected DoFs."""
        return len(self.names)

    @property
    def robot_size(self) -> int:
        """Number of the Robot's DoFs."""
        return len(self.robot_names)

    def read(self, values: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write the selected entries of `values`, shape (robot_size,), into `out`, shape (size,)."""
        return values.take(self.indices, out=out, mode="clip")

    def write(self, values: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write `values`, shape (size,), to the selected entries of `out`, shape (robot_size,)."""
        out[self.indices] = values
        return out

    def __repr__(self) -> str:
        return f"UnidirectionalMap({self.name}: {self.size} of {self.robot_size} DoFs)"


Map = TypeVar("Map", BidirectionalMap, UnidirectionalMap)


class Maps(Generic[Map]):
    """The maps of one Robot by name, in the order in which they were added.

    Args:
        kind: Kind of an element for errors, such as 'map'.
        robot_names: Names of the Robot's DoFs.
    """

    def __init__(self, kind: str, robot_names: Sequence[str]):
        self._kind = kind
        self._robot_names = tuple(robot_names)
        self._maps: dict[str, Map] = {}

    def add(self, new: Map, name: str | None = None) -> Map:
        """Add a map, under its own name or under `name`.

        Raises:
            ModelError: There is a map of that name, or the map belongs to other DoFs.
            SizeMismatch: The map belongs to a Robot of another size.
        """
        name = new.name if name is None else name
        if name in self._maps:
            raise ModelError(f"there is a {self._kind} '{name}' already", expected="a new name")
        if new.robot_size != len(self._robot_names):
            raise SizeMismatch(
                f"the {self._kind} '{name}' is made for {new.robot_size} DoFs, the robot has {len(self._robot_names)}"
            )
        if new.robot_names != self._robot_names:
            raise ModelError(
                f"the {self._kind} '{name}' is made for a robot with other DoFs",
                expected="a map between the names of this robot, in its order",
            )
        self._maps[name] = new
        return new

    def get(self, name: str, where: str = "") -> Map:
        """Return the map `name`; an UnknownName at `where` if there is none."""
        if name not in self._maps:
            raise UnknownName(self._kind, name, self._maps, where=where)
        return self._maps[name]

    def __getitem__(self, name: str) -> Map:
        return self.get(name)

    def __contains__(self, name: object) -> bool:
        return name in self._maps

    def __iter__(self) -> Iterator[str]:
        return iter(self._maps)

    def __len__(self) -> int:
        return len(self._maps)

    def __repr__(self) -> str:
        return f"Maps({', '.join(self._maps)})"


def _places(name: str, side: str, names: tuple[str, ...]) -> dict[str, int]:
    twice = [dof for dof, count in Counter(names).items() if count > 1]
    if twice:
        raise ModelError(
            f"names that stand twice among the {side}: {', '.join(twice)}",
            where=f"map '{name}'",
            expected="each name once",
        )
    return {dof: index for index, dof in enumerate(names)}
