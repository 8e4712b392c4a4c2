"""Waits for the robot: plugins may be started before it."""

import logging
from collections.abc import Callable, Iterable

from solfer.config import Configuration
from solfer.errors import UnknownName, nearest
from solfer.transport import Middleware

ROBOT_POLL_PERIOD = 0.2
"""Time between two looks [s]."""

ROBOT_REPEAT_PERIOD = 10.0
"""Time between two messages about the same [s]."""

logger = logging.getLogger(__name__)


def missing(configurations: Iterable[Configuration], middleware: Middleware) -> str:
    """Return what is missing of the robot that plugins are made for, in one line; empty: nothing.

    Raises:
        UnknownName: A description has a misspelt name.
    """
    found = (look(each, middleware) for each in configurations for look in (_description, _joints))
    return next(filter(None, found), "")


def wait_for_robot(
    configurations: Iterable[Configuration],
    middleware: Middleware,
    running: Callable[[], bool],
    pause: Callable[[], None],
) -> bool:
    """Wait until the robot is there; log what is missing, once and every `ROBOT_REPEAT_PERIOD` [s].

    Args:
        configurations: Those of the plugins.
        middleware: Where the robot is looked for.
        running: False as soon as the end was requested.
        pause: Lets `ROBOT_POLL_PERIOD` [s] pass.

    Returns:
        False if the end was requested.

    Raises:
        UnknownName: A description has a misspelt name.
    """
    configurations = tuple(configurations)
    looks = 0
    reported = ""
    while running():
        found = missing(configurations, middleware)
        if not found:
            if reported:
                logger.info("the robot is there")
            return True
        if found != reported or looks % round(ROBOT_REPEAT_PERIOD / ROBOT_POLL_PERIOD) == 0:
            logger.warning("waits for the robot: %s", found)
            reported = found
            looks = 0
        looks += 1
        pause()
    return False


def _description(configuration: Configuration, middleware: Middleware) -> str:
    """Return which description is missing."""
    for source in (configuration.sources.urdf, configuration.sources.srdf):
        if source is None or source.parameter is None:
            continue
        try:
            middleware.parameter(source.parameter, source.where())
        except UnknownName as error:
            if _is_misspelt(source.parameter, error.names):
                raise
            return f"no parameter '{source.parameter}' of a living robot ({source.where()})"
    return ""


def _joints(configuration: Configuration, middleware: Middleware) -> str:
    """Return whose publisher is missing of the measured joints that the plugin cannot start without."""
    measured = next((each for each in configuration.feedbacks if each.measures_joints), None)
    if measured is None or measured.source is None or not measured.initialize:
        return ""
    topic = middleware.resolve(measured.source)
    present = [each.lstrip("/") for each in middleware.topics().result().published]
    if topic.lstrip("/") in present or _is_misspelt(topic.lstrip("/"), present):
        return ""
    return f"no publisher on {topic} ({measured.where('source')})"


def _is_misspelt(name: str, present: Iterable[str]) -> bool:
    """Whether another name is meant that is present; the same one in a namespace is that of another robot."""
    last = name.rpartition("/")[2]
    # likeness to a name that is there from which on a missing one is a mistake, which is not waited for
    likeness = 0.85
    return bool(nearest(name, [each for each in present if each.rpartition("/")[2] != last], likeness=likeness))
