"""What a component declares besides its pipes: services, topics, actions and parameters, without any transport.

A middleware binds a declaration to its own means: the ROS middleware to a service, the memory middleware to a call.
Handlers run between two cycles, never in the middle of one.

Names are below the component's: `reference` of `arm` is `arm/reference`; one with a leading slash is whole. A message
is a dataclass with fields of its interface, nested as there: numbers, texts, tuples, dataclasses; times are floats [s].
What the dataclass leaves out is not received, and is sent as zero.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Accepted:
    """Reply of a service: whether a request is carried out, and why not."""

    success: bool = True
    message: str = ""


@dataclass(frozen=True)
class Service:
    """A request with a reply.

    Attributes:
        name: Name below the owner's, as in `<owner>/trajectory`.
        interface: `package/Type`, the name of the service type where a middleware has types (ROS: a .srv file).
        request: Dataclass of the request. Its fields are those of the interface; lists arrive as tuples.
        reply: Dataclass of the reply, with the fields of the interface.
        handler: Maps a `request` to a `reply`, or to a Future of one that takes many cycles. A `SolferError` that it
            raises becomes a refusal: the reply with `success` false and the error as `message`.
        timeout: Longest time until the reply [s].
        prepare: Does the slow part, such as reading a file, before the call waits for its turn: maps the `request`
            to the handler's argument. It raises as a handler does, and must not touch what the cycle
            uses.
        largest: Bytes of a request as it comes over a network; a larger one is refused undecoded.
        quick: Whether `prepare` takes less than a millisecond: it is rationed no more than what is urgent.
        commands: Whether it is to move the robot: the `message` of its reply says so where no node receives what the
            plugin publishes.
        urgent: Whether it goes before all others and is not rationed: it has to cost next to nothing.
    """

    name: str
    interface: str
    request: type
    reply: type
    handler: Callable[[Any], Any]
    timeout: float = 2.0
    prepare: Callable[[Any], Any] | None = None
    largest: int = 65536
    urgent: bool = False
    quick: bool = False
    commands: bool = True

    def prepared(self, request: Any) -> Callable[[], Any]:
        """Run `prepare`, and return the call that is left to do between two cycles. To be called outside of the cycle.

        Where `prepare` requests an end (SystemExit and its like), the returned call raises it in the loop: the loop
        owns the component, the thread that calls here does not.
        """
        if self.prepare is None:
            return functools.partial(self.handler, request)
        try:
            return functools.partial(self.handler, self.prepare(request))
        except Exception:
            raise
        except BaseException as error:
            return functools.partial(_raise, error)


@dataclass(frozen=True)
class TopicIn:
    """A topic that the component receives.

    Attributes:
        name: Its name, see above.
        interface: `package/Type` of its messages, with a header or without one.
        message: Dataclass of a message.
        handler: Gets every message, in the order of arrival. A `SolferError` that it raises is logged: no sender waits.
        stream: Topics of a component with the same stream have one sender at a time: the first, until it has been
            silent for 0.5 s. Messages of others are ignored, and both are named. Empty: every sender counts.
        ordered: Whether the stamps of each sender, in the header of `message`, may not go back. Those that stay back
            for 0.2 s are of another clock; 0 is no stamp.
    """

    name: str
    interface: str
    message: type
    handler: Callable[[Any], None]
    stream: str = ""
    ordered: bool = False


@dataclass(frozen=True)
class TopicOut:
    """A topic that the component publishes.

    Attributes:
        name: Its name, see above.
        interface: `package/Type` of its messages; a header is stamped where it is sent.
        message: Dataclass of a message.
        collect: Called after each `send` of the component: returns the message to publish; None: nothing this time.
        rest: Message that is published while the component, which has worked before, holds or has stopped; None: none.
        rate: How often it is collected at most; None: after each cycle [Hz].
    """

    name: str
    interface: str
    message: type
    collect: Callable[[], Any]
    rest: Any = None
    rate: float | None = None


@dataclass(frozen=True)
class Outcome:
    """How a goal of an action ended.

    Attributes:
        result: Of the action's `result`.
        success: Whether the goal was reached; false: the component has given it up.
        text: One sentence.
    """

    result: Any
    success: bool = True
    text: str = ""


@dataclass(frozen=True)
class Action:
    """A goal that takes many cycles, with feedback, a result, cancelling and preemption; one goal at a time.

    A new goal preempts the present one as soon as `begin` has taken it over; if `begin` refuses it the present one goes
    on. When the plugin holds, starts again or stops, the goal is aborted, and the component's `reset` or `stop` is
    called. The default of every field of `result` stands for a goal that did not come to its end.

    Attributes:
        name: Its name, see above.
        interface: `package/Type`; of the messages `<Type>ActionGoal` and so on where a middleware has types.
        goal: Dataclass of a goal.
        feedback: Dataclass of the feedback.
        result: Dataclass of the result; it can be made without arguments.
        begin: Takes over a goal, and returns None. A `SolferError` that it raises rejects the goal, with the error as
            text; so does an Outcome that it returns, with its result.
        outcome: Called after each cycle with a goal: None as long as it is in progress.
        report: Returns the feedback; called at `rate` while a goal is in progress.
        cancel: Leaves the goal: the component comes to rest.
        rate: Of the feedback [Hz].
    """

    name: str
    interface: str
    goal: type
    feedback: type
    result: type
    begin: Callable[[Any], Outcome | None]
    outcome: Callable[[], Outcome | None]
    report: Callable[[], Any]
    cancel: Callable[[], None]
    rate: float = 20.0


@dataclass(frozen=True)
class Parameter:
    """A value that the middleware may have, read once before the first cycle; where it has none, nothing is called.

    Attributes:
        name: Its name, see above.
        kind: Type of the value: float, int, bool or str.
        handler: Gets the value. A `SolferError` that it raises ends the start of the plugin.
    """

    name: str
    kind: type
    handler: Callable[[Any], None]


@dataclass(frozen=True)
class LiveParameter:
    """A tag of the component that can be changed while it runs.

    Attributes:
        path: Keys below the component's tags; the field there is marked `LIVE`.
        write: Takes the change over, between two cycles or before `update`, at the cost of a few assignments. It gets
            the numbers, and several times on their way to new ones; without `numbers` the new tags, which the component
            has already as its `tags`.
        numbers: Maps tags to the numbers that the tag stands for, one or an array of always the same shape, which move
            to new ones linearly. It raises a SolferError if they do not fit. Called outside of the cycle, and must not
            touch what the cycle uses. None: a change counts at once. Parameters with the same `write` have the same
            numbers.
    """

    path: tuple[str | int, ...]
    write: Callable[[Any], None] = lambda _: None
    numbers: Callable[[Any], Any] | None = None


Declaration = Service | TopicIn | TopicOut | Action | Parameter


def full_name(owner: str, name: str) -> str:
    """Return the whole name of what a component of the name `owner` declares."""
    return name[1:] if name.startswith("/") else f"{owner}/{name}"


def _raise(error: BaseException) -> None:
    raise error
