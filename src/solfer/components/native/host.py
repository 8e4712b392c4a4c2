"""What a library's component requests while it is made: arrays of the Robot, points, topics, services, logs."""

import ctypes
from collections.abc import Callable
from ctypes import POINTER, addressof, c_char, c_char_p, c_size_t, c_void_p, cast
from functools import wraps
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from solfer import points
from solfer.components.native import records
from solfer.components.native.messages import NumbersOfFields
from solfer.errors import ComponentError, SolferError, UnknownName
from solfer.interfaces.declaration import Service, TopicIn, TopicOut
from solfer.interfaces.port import Port
from solfer.points import Handler, Point

if TYPE_CHECKING:
    from solfer.components.base import Component
    from solfer.robot import Robot

OF_LINKS = (
    "AngularVelocity",
    "FrameOrientation",
    "LinearPoint",
    "LinearVelocity",
    "SpatialPoint",
    "SpatialVelocity",
)
OF_ROBOT = ("AngularMomentum", "CenterOfMass", "Posture")
OF_POINTS = ("Minus", "Norm", "Plus", "RelativePoint")
CONSTANT = "Constant"
KINDS = (*OF_LINKS, *OF_ROBOT, *OF_POINTS, CONSTANT)

DYNAMICS = ("bias", "inertia", "inertia_inverse")

STATES = ("state", "motor", "command", "lower_limits", "upper_limits")


class Host:
    """Answers a component while it is made, and keeps what it got.

    Args:
        component: The component.
        values: Values of its tags.
        time: Its time.

    Attributes:
        record: What the library gets.
        error: What could not be answered; None: everything was.
        points: Points that the component uses.
        services, topics: What it declares.
        logs: What it records: name, numbers and their unit.
        needs_dynamics: Whether it uses the Robot's dynamics.
    """

    def __init__(self, component: "Component", values: "ctypes.Array[records.Value]", time: records.Time):
        self._component = component
        self._robot: Robot = component.model
        self.error: Exception | None = None
        self.points: Handler[Point] = Handler()
        self.services: list[Service] = []
        self.topics: list[TopicIn | TopicOut] = []
        self.logs: list[tuple[str, np.ndarray, str]] = []
        self.needs_dynamics = False
        self._kept: list[Any] = []
        self._arrays: dict[tuple[str, str], records.Array] = {}
        self._placed: list[tuple[records.PointRecord, Point]] = []
        self._start = records.Array(None, self._robot.size, 1)
        self.record = records.HostRecord(
            name=component.name.encode(),
            size=self._robot.size,
            dofs=self._names(self._robot.dofs),
            time=ctypes.pointer(time),
            tags=cast(values, POINTER(records.Value)),
        )
        for name, kind in records.HOST_FUNCTIONS.items():
            failed = -1 if kind._restype_ in (ctypes.c_int, ctypes.c_long) else None  # type: ignore[attr-defined]
            setattr(self.record, name, kind(self._guarded(getattr(self, f"_{name}"), failed)))

    def place(self) -> None:
        """Write where the numbers of the points are into their records; after the last point."""
        if len(self.points):
            self.points.update()
        for record, point in self._placed:
            _locate(record.value, point.value)
            _locate(record.jacobian, point.jacobian)

    def start_at(self, position: np.ndarray) -> None:
        """Let the component find the position at the start, shape (n,) [rad, m]."""
        self._start.data = position.ctypes.data

    def _guarded(self, call: Callable[..., Any], failed: Any) -> Callable[..., Any]:
        """Keep the first error of a call: it cannot pass through the library."""

        @wraps(call)
        def guarded(_context: int, *given: Any) -> Any:
            try:
                return call(*given)
            except Exception as error:
                self.error = self.error or self._placed_error(error)
                return failed

        return guarded

    def _placed_error(self, error: Exception) -> Exception:
        tags = self._component.tags
        if isinstance(error, SolferError):
            named = (key for key, value in tags if isinstance(value, str) and value and repr(value) in str(error))
            error.at(tags.where(*islice(named, 1)))
        return error

    def _keep(self, value: Any) -> Any:
        self._kept.append(value)
        return value

    def _names(self, names: Any) -> Any:
        """Return an array of texts that stays."""
        return self._keep((c_char_p * len(names))(*(name.encode() for name in names)))

    def _dof(self, name: bytes) -> int:
        return self._robot.dof(records.text(name))

    def _group(self, name: bytes, count: Any) -> int:
        robot = self._robot
        key = records.text(name)
        if key in robot.selectors:
            indices = robot.selectors[key].indices
        elif key in robot.maps:
            indices = robot.maps[key].robot_indices
        else:
            raise UnknownName("group or map", key, (*robot.selectors, *robot.maps))
        count[0] = len(indices)
        return addressof(self._keep((c_size_t * max(len(indices), 1))(*indices.tolist())))

    def _links(self, group: bytes, count: Any) -> int:
        links = self._robot.links(records.text(group))
        count[0] = len(links)
        return addressof(self._names(links or ("",)))

    def _array(self, source: bytes, name: bytes) -> int:
        key = records.text(source), records.text(name)
        if key not in self._arrays:
            self._arrays[key] = self._start if key[0] == "start" else _located(self._numbers(*key))
        return addressof(self._arrays[key])

    def _numbers(self, source: str, name: str) -> np.ndarray:
        robot = self._robot
        if source == "dynamics":
            if name not in DYNAMICS:
                raise UnknownName("element of the dynamics", name, DYNAMICS)
            robot.dynamics.subscribe(name)
            self.needs_dynamics = True
            return getattr(robot.dynamics, name)
        if source not in STATES:
            raise UnknownName("source of numbers", source, (*STATES, "dynamics", "start"))
        state = getattr(robot, source)
        if source == "command" and name not in state:
            return state.add(name)
        return state[name]

    def _point(self, request: Any) -> int:
        given = request[0]
        name = records.text(given.kind)
        if name not in KINDS:
            raise UnknownName("kind of point", name, KINDS)
        numbers = list(given.numbers[: given.number_count])
        make = getattr(points, name)
        if name in OF_LINKS:
            offset = {"offset": numbers} if numbers else {}
            point = make(records.text(given.link), self._robot, **offset)
        elif name in OF_ROBOT:
            point = make(self._robot)
        elif name in OF_POINTS:
            point = make(*(self.points[index] for index in given.operands[: given.operand_count]))
        else:
            point = make(numbers)
        record = self._keep(records.PointRecord(len(self.points)))
        self._placed.append((record, self.points.add(point)))
        return addressof(record)

    def _port(self, is_output: int, name: bytes, quantity: bytes) -> int:
        ports = self._component.outputs if is_output else self._component.inputs
        key = records.text(name)
        if key not in ports:
            ports[key] = Port(records.text(quantity), required=not is_output)
        return addressof(self._keep(_located(ports[key].value)))

    def _log(self, name: bytes, numbers: Any, size: int, unit: bytes) -> int:
        self.logs.append((records.text(name), _array_at(numbers, size), records.text(unit)))
        return 0

    def _receive(self, endpoint: Any) -> int:
        topic = endpoint[0]
        name = records.text(topic.name)
        message = NumbersOfFields(name, records.texts(topic.fields, topic.field_count))
        receive = self._handler(topic, message)
        self.topics.append(TopicIn(name, records.text(topic.interface), message.message, handler=receive))
        return 0

    def _publish(self, endpoint: Any) -> int:
        topic = endpoint[0]
        name = records.text(topic.name)
        message = NumbersOfFields(name, records.texts(topic.fields, topic.field_count))
        array = _array_at(topic.numbers, message.size)
        self.topics.append(
            TopicOut(
                name,
                records.text(topic.interface),
                message.message,
                collect=lambda: message.made(array.tolist()),
                rate=topic.rate if topic.rate > 0.0 else None,
            )
        )
        return 0

    def _serve(self, endpoint: Any) -> int:
        service = endpoint[0]
        name = records.text(service.name)
        received = NumbersOfFields(f"{name} request", records.texts(service.fields, service.field_count))
        accepted = (("success", bool, True), ("message", str, ""))
        replies = records.texts(service.reply_fields, service.reply_field_count)
        sent = NumbersOfFields(f"{name} reply", replies, more=accepted)
        call = self._handler(service, received, sent)
        self.services.append(
            Service(name, records.text(service.interface), received.message, reply=sent.message, handler=call)
        )
        return 0

    def _handler(
        self, endpoint: records.Endpoint, received: NumbersOfFields, sent: NumbersOfFields | None = None
    ) -> Callable[[Any], Any]:
        run = records.Handler(endpoint.handler)
        user = c_void_p(endpoint.user)
        numbers = np.zeros(max(received.size, 1))
        reply = np.zeros(0 if sent is None else max(sent.size, 1))
        first, second = (each.ctypes.data_as(records.Doubles) for each in (numbers, reply))
        room = (c_char * records.ERROR_SIZE)()
        component = self._component

        def handle(message: Any) -> Any:
            numbers[: received.size] = received.numbers(message)
            if run(user, first, None if sent is None else second, room, len(room)):
                what = f"{component.name} refuses: {records.text(room.value)}"
                raise ComponentError(what, expected="what its handler accepts")
            return None if sent is None else sent.made(reply[: sent.size].tolist())

        return handle


def _locate(record: records.Array, array: np.ndarray) -> None:
    if not array.flags.c_contiguous:
        raise ComponentError("numbers that are not contiguous", expected="an array in one piece")
    record.data = array.ctypes.data
    record.rows, record.columns = (array.shape[0], 1) if array.ndim == 1 else array.shape


def _located(array: np.ndarray) -> records.Array:
    record = records.Array()
    _locate(record, array)
    return record


def _array_at(numbers: Any, size: int) -> np.ndarray:
    """Return the numbers of a library as an array, shape (size,), without a copy."""
    return np.ctypeslib.as_array(numbers, shape=(size,))
