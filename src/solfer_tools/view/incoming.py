"""What pages send: viser gets only what a page may do, with numbers that its widgets can have."""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable
from typing import Any

import msgspec
from viser import GuiSliderHandle, ViserServer, _messages
from websockets.asyncio.server import ServerConnection

from solfer.throttle import Throttle

DRAG_MESSAGES = (
    _messages.TransformControlsDragStartMessage,
    _messages.TransformControlsUpdateMessage,
    _messages.TransformControlsDragEndMessage,
)

logger = logging.getLogger(__name__)


class IncomingMessages:
    """Checks each message of a page before viser shares it with all pages.

    What a page may not change is set back on that page. All of it runs in the server's thread.

    Args:
        viser: The pages.

    Attributes:
        may_command: Whether a page commands: it alone changes inputs and drags.
        is_free: Whether no page commands.
        display: Identities of widgets that command nothing: any page uses them while no page commands.
    """

    def __init__(self, viser: ViserServer):
        self._viser = viser
        self._throttle = Throttle(logger)
        self.may_command: Callable[[int], bool] = lambda _: False
        self.is_free: Callable[[], bool] = lambda: True
        self.display: set[str] = set()
        # all that pages send; viser would also take files, and be reached from other machines
        types = (
            _messages.ViewerCameraMessage,
            _messages.GuiUpdateMessage,
            *DRAG_MESSAGES,
        )
        self._types = {each.__name__: each for each in types}

    async def receive(self, connection: ServerConnection, receive: Callable[[], Awaitable[str | bytes]]) -> bytes:
        """Return the next message of a page that viser may have."""
        while True:
            raw = await receive()
            await asyncio.sleep(0.0)  # a page that floods leaves their turn to the others
            try:
                message = self._checked(connection, self._decoded(raw))
            except (ValueError, TypeError, KeyError, RecursionError) as error:
                self._throttle.warning("junk", "a page sends what is no message of it: %s", type(error).__name__)
                continue
            if message is not None:
                return msgspec.msgpack.encode(message.as_serializable_dict())

    def _checked(self, connection: ServerConnection, message: _messages.Message) -> _messages.Message | None:
        """Return a message as viser may have it; None: it may not."""
        connections = self._viser._websock_server._live_connections
        page = next(number for number, each in connections.items() if each is connection)
        if isinstance(message, _messages.GuiUpdateMessage):
            return self._checked_update(page, message)
        if isinstance(message, DRAG_MESSAGES) and not self.may_command(page):
            self._put_back(page, message.name)
            return None
        return message

    def _checked_update(self, page: int, message: _messages.GuiUpdateMessage) -> _messages.Message | None:
        if set(message.updates) != {"value"}:  # viser would also change what belongs to the server alone
            raise ValueError
        value = message.updates["value"]
        handle = self._viser.gui._gui_input_handle_from_uuid.get(message.uuid)
        if handle is None:  # of a dialog of this page
            return message
        if message.uuid in self.display:
            is_allowed = self.is_free() or self.may_command(page)
        else:
            is_allowed = handle._impl.is_button or self.may_command(page)
        fitting = _fitting(handle, value) if is_allowed else None
        if fitting != value and not handle._impl.is_button:
            kept = handle.value if fitting is None else fitting
            self._send(page, _messages.GuiUpdateMessage(message.uuid, {"value": kept}))
        return None if fitting is None else _messages.GuiUpdateMessage(message.uuid, {"value": fitting})

    def _decoded(self, raw: str | bytes) -> _messages.Message:
        """Make a message of its bytes, strictly: viser itself accepts any shape, and warns without a bound.

        Raises:
            ValueError, TypeError, KeyError, RecursionError: It is none.
        """
        if isinstance(raw, str):
            raise TypeError
        fields = msgspec.msgpack.decode(raw, type=dict[str, Any])
        message = msgspec.convert(fields, self._types[fields.pop("type")], strict=False)
        if not _is_finite(tuple(vars(message).values())):
            raise ValueError
        return message

    def _put_back(self, page: int, name: str) -> None:
        handle = self._viser.scene._handle_from_transform_controls_name.get(name)
        if handle is not None:
            self._send(page, _messages.SetPositionMessage(name, tuple(handle.position.tolist())))
            self._send(page, _messages.SetOrientationMessage(name, tuple(handle.wxyz.tolist())))

    def _send(self, page: int, message: _messages.Message) -> None:
        self._viser._websock_server._client_state_from_id[page].message_buffer.push(message)


def _is_finite(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_finite(each) for each in value)
    return not isinstance(value, float) or math.isfinite(value)


def _fitting(handle: Any, value: Any) -> Any:
    """Return the value that a widget takes instead of one; None: that is none of its."""
    if isinstance(handle, GuiSliderHandle):
        is_number = type(value) in (int, float) and math.isfinite(value)
        return min(max(float(value), handle.min), handle.max) if is_number else None
    is_own = type(value) is type(handle.value) and value in getattr(handle, "options", (value,))
    return value if is_own else None
