"""References that an operator drags."""

from dataclasses import dataclass, replace

import numpy as np

from solfer.interfaces.task_references import REFERENCE_MESSAGES
from solfer.numerics.rotations import quaternion_from_rotation
from solfer.transport import Middleware, Writer
from solfer.transport.messages import VectorMessage
from solfer_tools.scene.state import ScenePose, ShownReference

OPERATOR_SILENCE = 1.0
"""Time without a movement or a sign of life of its operator after which a reference is released [s]."""


@dataclass(frozen=True, eq=False)
class _Drag:
    client: str
    numbers: np.ndarray
    since: float


class DraggedReferences:
    """Publishes references as long as they are dragged, on the topics of their tasks, as every sender does.

    One client at a time drags a reference: the first, until it releases it or is silent.

    Args:
        middleware: Carries them.
    """

    def __init__(self, middleware: Middleware):
        self._middleware = middleware
        self._writers: dict[tuple[str, str], Writer] = {}
        self._drags: dict[tuple[str, str], _Drag] = {}

    def drag(self, shown: ShownReference, client: str, pose: ScenePose | None = None) -> bool:
        """Let a client move a reference.

        Args:
            shown: The reference.
            client: The client.
            pose: Where it is to be, in the frame of the task; None: it still drags it.

        Returns:
            Whether it is this client that drags it.
        """
        key = (shown.module, shown.task)
        now = self._middleware.now()
        present = self._drags.get(key)
        if present is not None and present.client != client and now - present.since <= OPERATOR_SILENCE:
            return False
        if pose is not None:
            numbers = {
                "position": pose.position,
                "orientation": quaternion_from_rotation(pose.rotation),
                "pose": np.concatenate((pose.position, quaternion_from_rotation(pose.rotation))),
            }[shown.quantity]
            if key not in self._writers:
                topic = self._middleware.resolve(f"{shown.module}/{shown.task}/reference")
                self._writers[key] = self._middleware.declared_writer(topic, REFERENCE_MESSAGES[shown.quantity][0])
            self._drags[key] = _Drag(client, numbers, now)
            return True
        if present is None or present.client != client:
            return False
        self._drags[key] = replace(present, since=now)
        return True

    def release(self, shown: ShownReference, client: str) -> None:
        """Stop publishing a reference that this client drags."""
        key = (shown.module, shown.task)
        if key in self._drags and self._drags[key].client == client:
            del self._drags[key]

    def is_dragged(self, shown: ShownReference) -> bool:
        """Return whether a client drags a reference."""
        return (shown.module, shown.task) in self._drags

    def publish(self) -> None:
        """Publish what is dragged at present."""
        now = self._middleware.now()
        self._drags = {key: drag for key, drag in self._drags.items() if now - drag.since <= OPERATOR_SILENCE}
        for key, drag in self._drags.items():
            self._writers[key].write(VectorMessage("", drag.numbers.copy()))
