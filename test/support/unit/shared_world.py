"""Nodes of one namespace on a virtual clock, one of which may offer a service."""

from dataclasses import dataclass

from support.bus_clock import BusClock

from solfer.components import Service
from solfer.errors import ComponentError
from solfer.middleware.memory import Bus
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.transport import Inbox


@dataclass(frozen=True)
class Scale:
    numbers: tuple[float, ...]
    factor: float = 1.0
    title: str = ""


@dataclass(frozen=True)
class Scaled:
    success: bool = True
    message: str = ""
    numbers: tuple[float, ...] = ()


class SharedWorld:
    """Nodes of one namespace on a virtual clock."""

    def __init__(self, folder):
        self.bus, self._folder = Bus(), folder

    def node(self, name="node", **parameters):
        namespace = Namespace("test", self._folder)
        return XbotMiddleware(namespace, name, parameters, clock=BusClock(self.bus))

    def serve(self, handler, refusal="", prepare=None, timeout=2.0):
        """Make a node with a loop that offers `scaler/scale`; returns its middleware and its inbox."""
        node, inbox = self.node("server"), Inbox(refusal)
        service = Service("scale", "test/Scale", Scale, Scaled, handler, timeout, prepare)
        node.serve("scaler", [service], inbox.submit)

        def cycle():
            node.poll()
            inbox.apply()

        self.bus.every(0.002, cycle)
        return node, inbox


def scale(request):
    if request.factor < 0:
        raise ComponentError("the factor is negative", expected="a positive one")
    return Scaled(message=request.title, numbers=tuple(request.factor * number for number in request.numbers))


def ask(node, numbers=(1.0, 2.0), factor=2.0, timeout=1.0, **fields):
    return node.call("scaler/scale", "test/Scale", Scale(tuple(numbers), factor, **fields), Scaled, timeout)
