"""Joints of a model, as the encoders of a robot's hardware count and name them."""

from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from solfer.errors import SimulationError, UnknownName
from solfer.simulation.mock_hardware.records import EncoderRecord
from solfer.transport.messages import GAINS, JOINT_FIELDS, JointMessage


class Encoders:
    """Translates messages between a model and the hardware.

    With an encoder's direction d and zero z, a joint at q reads h = d (q - z). Velocities and efforts have the
    direction only; stiffness and damping have neither.

    Args:
        records: Encoders by the model's joints, in the order of the hardware.
        joints: The model's joints.
        where: Place of the records, for errors.

    Raises:
        UnknownName: An encoder of a joint that the model does not have.
        SimulationError: A joint without an encoder, or two of the same name.
    """

    def __init__(self, records: Mapping[str, EncoderRecord], joints: Collection[str], where: str = ""):
        for joint, record in records.items():
            if joint not in joints:
                raise UnknownName("joint", joint, joints, where=record.where())
        blind = [joint for joint in joints if joint not in records]
        if blind:
            raise SimulationError(
                f"joints without an encoder: {', '.join(blind)}",
                where=where,
                expected="an entry below `joints` for each joint that moves",
            )
        self._encoders = dict(records)
        self._hardware = {joint: record.name for joint, record in records.items()}
        self._joints = {name: joint for joint, name in self._hardware.items()}
        if len(self._joints) < len(self._hardware):
            names = list(self._hardware.values())
            twice = next(record for record in records.values() if names.count(record.name) > 1)
            raise SimulationError(
                f"two encoders have the name '{twice.name}'",
                where=twice.where("name"),
                expected="a name of its own for each encoder",
            )

    def joint(self, name: str) -> str:
        """Return the model's name of a joint.

        Raises:
            UnknownName: The hardware has no joint `name`.
        """
        if name not in self._joints:
            raise UnknownName("joint of the hardware", name, self._joints)
        return self._joints[name]

    def name(self, joint: str) -> str:
        """Return the hardware's name of a joint; another word stays as it is."""
        return self._hardware.get(joint, joint)

    def ordered(self, joints: Iterable[str]) -> tuple[str, ...]:
        """Return the hardware's names of `joints`, in its own order."""
        members = set(joints)
        return tuple(name for joint, name in self._hardware.items() if joint in members)

    def measured(self, message: JointMessage) -> JointMessage:
        """Convert a message of the model's joints to the hardware's names, order and numbers."""
        names = self.ordered(message.names)
        place = {joint: index for index, joint in enumerate(message.names)}
        order = [place[self._joints[name]] for name in names]
        direction, zero = self._geometry(names)
        sent = JointMessage(names, stamp=message.stamp)
        for field in JOINT_FIELDS:
            values = getattr(message, field)
            if values is not None:
                values = np.asarray(values)[order]
                values = values if field in GAINS else direction * (values - zero if field == "position" else values)
                setattr(sent, field, values)
        return sent

    def commanded(self, message: JointMessage) -> JointMessage:
        """Convert a message for the hardware's joints to names and numbers of the model; arrays of a wrong size stay.

        Raises:
            UnknownName: The hardware has no joint of that name.
        """
        direction, zero = self._geometry(message.names)
        taken = JointMessage(
            tuple(self.joint(name) for name in message.names),
            interfaces=message.interfaces,
            values=message.values,
            stamp=message.stamp,
            sender=message.sender,
            component=message.component,
        )
        for field in JOINT_FIELDS:
            values = getattr(message, field)
            if values is not None and np.shape(values) == direction.shape and field not in GAINS:
                values = direction * values + (zero if field == "position" else 0.0)
            setattr(taken, field, values)
        return taken

    def positions(self, names: Sequence[str], read: Sequence[float]) -> tuple[float, ...]:
        """Convert what encoders of the hardware's joints read to the model's positions [rad, m]; too few stay.

        Raises:
            UnknownName: The hardware has no joint of that name.
        """
        taken = self.commanded(JointMessage(tuple(names), position=np.array(read, dtype=float)))
        return tuple(np.asarray(taken.position).tolist())

    def _geometry(self, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        encoders = [self._encoders[self.joint(name)] for name in names]
        return np.array([float(each.direction) for each in encoders]), np.array([each.zero for each in encoders])
