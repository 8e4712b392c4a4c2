"""Quality of service of topics, and publishers and readers that do not fit each other."""

import logging
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

logger = logging.getLogger(__name__)

PERIOD = 1.0
"""Time between two looks at the other nodes [s]."""


def quality(depth: int, reliable: bool, latched: bool = False) -> QoSProfile:
    """Make the quality of service of a topic: measurements may be lost; a late reader receives latched messages."""
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


class Ended(Protocol):
    """One end of a topic in this process; `requires`: what it requires of publishers, or offers to readers."""

    topic: str
    receives: bool
    requires: QoSProfile


STRONGER = {"reliability": ReliabilityPolicy.RELIABLE, "durability": DurabilityPolicy.TRANSIENT_LOCAL}
"""Policies of which a reader that requires this one gets nothing of a publisher with the other one."""


class MismatchWatch:
    """Warns once of each node of which, or at which, nothing arrives since the policies of a topic differ.

    Args:
        node: The node; its executor looks once in a period, outside of the loop.
        ends: Returns the topics of this process.
    """

    def __init__(self, node: Node, ends: Callable[[], Sequence[Ended]]):
        self._node = node
        self._name = node.get_fully_qualified_name()
        self._ends = ends
        self._warned: set[tuple[str, bytes, str]] = set()
        node.create_timer(PERIOD, self._look)

    def _look(self) -> None:
        for end in tuple(self._ends()):
            others = self._node.get_publishers_info_by_topic if end.receives else self._others_of
            self._compare(end, others(end.topic))

    def _others_of(self, topic: str) -> list[Any]:
        return self._node.get_subscriptions_info_by_topic(topic)

    def _compare(self, end: Ended, others: Iterable[Any]) -> None:
        for other in others:
            for policy, strong in STRONGER.items():
                ours, theirs = (getattr(each, policy) for each in (end.requires, other.qos_profile))
                required, offered = (ours, theirs) if end.receives else (theirs, ours)
                key = end.topic, bytes(other.endpoint_gid), policy
                if required == strong and offered != strong and key not in self._warned:
                    self._warned.add(key)
                    self._warn(end, f"{other.node_namespace.rstrip('/')}/{other.node_name}", policy, ours, theirs)

    def _warn(self, end: Ended, other: str, policy: str, ours: Any, theirs: Any) -> None:
        fact, verbs, kind = (
            (f"nothing of {other} arrives", ("publishes", "requires"), "publisher")
            if end.receives
            else (f"nothing arrives at {other}", ("requires", "publishes"), "subscription")
        )
        logger.warning(
            "topic %s: %s, which %s %s where %s %s %s; expected: a %s with %s %s in %s",
            end.topic,
            fact,
            verbs[0],
            _words(theirs),
            self._name,
            verbs[1],
            _words(ours),
            kind,
            policy,
            ours.name,
            other,
        )


def _words(policy: Any) -> str:
    return str(policy.name).lower().replace("_", " ")
