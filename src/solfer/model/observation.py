"""Looks at the calls of a method from outside, so that it costs nothing without an observer."""

from collections.abc import Callable
from typing import Any

End = Callable[[], None]
"""Ends an observation."""


def observed(
    thing: Any, method: str, after: Callable[..., None] | None = None, before: Callable[..., None] | None = None
) -> End:
    """Observe the calls of one object's method, until the returned function is called.

    Of several observations of one method the last one ends first.

    Args:
        thing: The object.
        method: Name of its method, or of an attribute that is called.
        after: Is called after each call, with its result and its arguments.
        before: Is called before each call, with its arguments.
    """
    original = getattr(thing, method)
    own = method in vars(thing)

    def call(*arguments: Any) -> Any:
        if before is not None:
            before(*arguments)
        result = original(*arguments)
        if after is not None:
            after(result, *arguments)
        return result

    def end() -> None:
        if own:
            setattr(thing, method, original)
        else:
            delattr(thing, method)

    setattr(thing, method, call)
    return end
