"""A component whose class is in a library."""

import ctypes
from ctypes import c_char
from functools import cache
from typing import Any, ClassVar

from solfer.components.base import Component
from solfer.components.native import records
from solfer.components.native.host import Host
from solfer.components.native.library import NativeClass, find_class
from solfer.components.native.tags import RELEASES_GIL, fill, record_of
from solfer.errors import ComponentError
from solfer.interfaces.declaration import LiveParameter, Service, TopicIn, TopicOut
from solfer.numerics.planar_move import PlanarMove
from solfer.robot import Robot


class NativeComponent(Component):
    """Hands each call over to an object of a library; base class of the classes that `load_native` makes.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Raises:
        ComponentError: The library's object cannot be made.
        SolferError: It requests something that the Robot does not have.
    """

    native: ClassVar[NativeClass]

    def __init__(self, robot: Robot, tags: Any, name: str = ""):
        super().__init__(robot, tags, name or self.native.name)
        record = self.native.record
        declared = [each for each in type(tags).model_fields if each != RELEASES_GIL]
        self._values = (records.Value * len(declared))()
        for value, key in zip(self._values, declared, strict=True):
            fill(value, getattr(tags, key))
        self._places = {key: index for index, key in enumerate(declared)}
        self._time = records.Time(pace=1.0)
        self._host = host = Host(self, self._values, self._time)
        self._destroy = records.Destroy(record.destroy)
        self._text = records.ErrorText(record.error)
        self._instance = self._created()
        self.dynamics = host.needs_dynamics
        host.place()
        self._points = host.points if len(host.points) else None
        step = records.FreeStep if getattr(tags, RELEASES_GIL) else records.Step
        self._init, self._update, self._send, self._reset, self._stop = (
            step(getattr(record, each)) if getattr(record, each) else _nothing for each in records.STEPS
        )

    def _created(self) -> ctypes.c_void_p:
        room = (c_char * records.ERROR_SIZE)()
        host = self._host
        instance = records.Create(self.native.record.create)(ctypes.byref(host.record), room, len(room))
        if host.error is not None:
            if instance:
                self._destroy(instance)
            raise host.error
        if not instance:
            what = f"the component {self.native.name} of '{self.name}' cannot be made: {records.text(room.value)}"
            raise ComponentError(
                what, where=self.tags.where(), expected=f"what its constructor in {self.native.file.name} accepts"
            )
        return ctypes.c_void_p(instance)

    def set_rate(self, rate: float) -> None:
        """See `Component.set_rate`."""
        super().set_rate(rate)
        self._time.period = self.period

    def let_pass(self, passed: float, lost: float = 0.0) -> None:
        """See `Component.let_pass`."""
        super().let_pass(passed, lost)
        time = self._time
        time.passed = passed
        time.step = self.time_step
        time.lost = lost

    def init(self) -> None:
        """See `Component.init`."""
        self._host.start_at(self.start_position)
        self._time.pace = self.pace
        if self._points is not None:
            self._points.update()
        if self._init(self._instance):
            self._fail("init")

    def update(self) -> None:
        """See `Component.update`."""
        self._time.pace = self.pace
        if self._points is not None:
            self._points.update()
        if self._update(self._instance):
            self._fail("update")

    def send(self) -> None:
        """See `Component.send`."""
        if self._send(self._instance):
            self._fail("send")

    def reset(self) -> None:
        """See `Component.reset`."""
        if self._reset(self._instance):
            self._fail("reset")

    def stop(self) -> None:
        """See `Component.stop`."""
        if self._stop(self._instance):
            self._fail("stop")

    def close(self) -> None:
        """Destroy the library's object."""
        if self._instance:
            self._destroy(self._instance)
            self._instance = ctypes.c_void_p(None)

    def start_log(self, logger: Any) -> None:
        """See `Component.start_log`."""
        for name, array, unit in self._host.logs:
            logger.add(name, array, unit=unit)

    def services(self) -> tuple[Service, ...]:
        """See `Component.services`."""
        return tuple(self._host.services)

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """See `Component.topics`."""
        return tuple(self._host.topics)

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Return those that the class declares as live; the component reads their numbers where they are."""
        record = self.native.record
        live = [records.text(tag.name) for tag in record.tags[: record.tag_count] if tag.is_live]
        return tuple(self._live(key) for key in live)

    def _live(self, key: str) -> LiveParameter:
        value = self._values[self._places[key]]

        def write(number: Any) -> None:
            value.number = float(number)

        return LiveParameter((key,), write=write, numbers=lambda tags: getattr(tags, key))

    def _fail(self, step: str) -> None:
        what = records.text(self._text(self._instance))
        raise ComponentError(
            f"{self.native.name}::{step} of {self.native.file.name} failed: {what}",
            expected="a component without mistakes in its own code",
        )


class MovingNativeComponent(NativeComponent):
    """One whose class moves its references with the world; base class of those."""

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`."""
        given = records.Move(tuple(move.before), tuple(move.after), move.yaw)
        if records.MoveWorld(self.native.record.move_world)(self._instance, ctypes.byref(given)):
            self._fail("move_world")


def _nothing(_instance: Any) -> int:
    return 0


@cache
def _class_of(native: NativeClass) -> type[NativeComponent]:
    record = native.record
    tags = record_of(native.name, list(record.tags[: record.tag_count]))
    about = records.text(record.description) or f"The component {native.name} of {native.file.name}."
    base = MovingNativeComponent if record.move_world else NativeComponent
    return type(native.name, (base,), {"native": native, "Tags": tags, "__doc__": about})


def load_native(target: str, where: str = "") -> type[NativeComponent]:
    """Load `library::Class`, see `find_class`."""
    return _class_of(find_class(target, where))
