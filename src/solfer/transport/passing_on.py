"""A middleware in front of another one."""

import abc
from operator import attrgetter

from solfer.transport.middleware import Middleware


class PassingMiddleware(Middleware):
    """Passes everything on to another middleware; a subclass defines what it does otherwise.

    For mypy it is abstract: who makes one writes `# type: ignore[abstract]`.

    Args:
        outside: The other middleware.
    """

    def __init__(self, outside: Middleware):
        self._outside = outside


for _name in ("name", "_first_order", *(each for each in vars(Middleware) if not each.startswith("_"))):
    # what the other one has, also its methods: a call of them costs no call in between
    setattr(PassingMiddleware, _name, property(attrgetter(f"_outside.{_name}")))
abc.update_abstractmethods(PassingMiddleware)  # type: ignore[type-abstract]
