"""A server for Foxglove: joints, frames, odometry, forces, columns and parameters, by its websocket protocol."""

import json
import secrets
import time
from functools import partial
from typing import Any

import numpy as np

from solfer.errors import MiddlewareError, MissingDependency
from solfer.installation import pip_install
from solfer.numerics.rotations import quaternion_from_rotation
from solfer_tools.scene import ContactForce, SceneState
from solfer_tools.view.columns import PlottedColumns
from solfer_tools.view.commands.control import PageControl
from solfer_tools.view.commands.parameters import KnownParameters
from solfer_tools.view.commands.requests import PageRequests
from solfer_tools.view.drawing import FORCE_COLOR, FORCE_SCALE
from solfer_tools.view.foxglove_relay import FOXGLOVE, FoxgloveRelay
from solfer_tools.view.server import PageServer, quiet_logger

try:
    import foxglove
    from foxglove import Channel, Context, Parameter
    from foxglove.channels import FrameTransformsChannel, JointStatesChannel, OdometryChannel, SceneUpdateChannel
    from foxglove.messages import (
        ArrowPrimitive,
        Color,
        FrameTransform,
        FrameTransforms,
        JointState,
        JointStates,
        Odometry,
        Pose,
        Quaternion,
        SceneEntity,
        SceneUpdate,
        Timestamp,
        Vector3,
    )
    from foxglove.websocket import Capability, Client, ServerListener
except ModuleNotFoundError as error:
    raise MissingDependency(
        f"a server for Foxglove needs foxglove-sdk, and there is no module '{error.name}'",
        expected=pip_install("foxglove-sdk", file="requirements-view.txt"),
    ) from error


class FoxgloveServer(ServerListener):
    """Serves what a page shows, at the address of the page.

    The server of foxglove-sdk checks neither origin nor token. So the page's server does, and relays; the one behind it
    has a random address of this machine, which no web page finds, and only relayed clients have parameters.

    Args:
        server: The page.
        requests: Calls the services of parameters.
        columns: Numbers over time, one message of all.
        parameters: Those of the parts.
        control: Lets parameters change while no page commands; None: they do not change.

    Raises:
        MiddlewareError: It cannot be served.
    """

    def __init__(
        self,
        server: PageServer,
        requests: PageRequests,
        columns: PlottedColumns,
        parameters: KnownParameters,
        control: PageControl | None,
    ):
        middleware = requests.middleware
        self._requests = requests
        self._columns = columns
        self._parameters = parameters
        self._control = control
        self._joints = middleware.reader("joint_states", "sensor_msgs/JointState")
        self._odometry = middleware.reader("odometry/odom", "nav_msgs/Odometry")
        self._published: dict[str, Any] = {}
        context = Context()
        self._context = context  # channels end with it
        quiet_logger("foxglove")
        self._joint_states = JointStatesChannel("/joint_states", context=context)
        self._tf = FrameTransformsChannel("/tf", context=context)
        self._odom = OdometryChannel("/odometry", context=context)
        self._forces = SceneUpdateChannel("/forces", context=context)
        self._numbers = Channel("/columns", message_encoding="json", context=context)
        host = ".".join(map(str, (127, *(1 + secrets.randbelow(254) for _ in range(3)))))
        try:
            self._server = foxglove.start_server(
                name="solfer",
                host=host,
                port=0,
                capabilities=[Capability.Parameters],
                server_listener=self,
                context=context,
            )
        except Exception as error:  # whatever the library raises
            raise MiddlewareError(f"no server for Foxglove: {error}", expected="a free port") from None
        self._relay = FoxgloveRelay(server, f"ws://{host}:{self._server.port}")

    @property
    def address(self) -> str:
        """Address of the server, with the token of the page."""
        return self._relay.address

    def update(self, state: SceneState | None) -> None:
        """Publish what is new; of a channel without subscribers nothing is made."""
        values = self._values()
        changed = [name for name, value in values.items() if self._published.get(name) != value]
        if changed:
            self._published = values
            self._server.publish_parameter_values([Parameter(name, value=values[name]) for name in changed])
        if state is None:
            return
        stamp = Timestamp.from_epoch_secs(time.time())
        if self._joint_states.has_sinks():
            self._publish_joints(stamp)
        if self._tf.has_sinks():
            frames = [
                FrameTransform(
                    timestamp=stamp,
                    parent_frame_id=state.frame,
                    child_frame_id=link,
                    translation=_vector(pose.position),
                    rotation=_quaternion(quaternion_from_rotation(pose.rotation)),
                )
                for link, pose in state.measured.items()
            ]
            self._tf.log(FrameTransforms(transforms=frames))
        if self._odom.has_sinks():
            self._publish_odometry(stamp)
        if self._forces.has_sinks():
            arrows = [_arrow(force) for force in state.forces if force.touches]
            entity = SceneEntity(timestamp=stamp, frame_id=state.frame, id="forces", arrows=arrows)
            self._forces.log(SceneUpdate(entities=[entity]))
        if self._numbers.has_sinks():
            numbers = ((name, self._columns.value(name)) for name in self._columns.names())
            self._numbers.log({name: value for name, value in numbers if np.isfinite(value)})

    def close(self) -> None:
        """End it."""
        self._server.stop()

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """Return parameters; without names all."""
        if not self._relay.knows(client.id, request_id):
            return []
        values = self._values()
        requested = (name for name in values if not param_names or name in param_names)
        return [Parameter(name, value=values[name]) for name in requested]

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """Let parameters change; their present values are returned, and the new ones published once they count."""
        known = self._values()
        for each in parameters:
            if self._relay.knows(client.id) and each.name in known:
                self._requests.submit((FOXGLOVE, each.name), partial(self._set, each))
        return self.on_get_parameters(client, [each.name for each in parameters])

    def _set(self, changed: Parameter) -> None:
        part, _, parameter = changed.name.partition(".")
        self._published.pop(changed.name, None)  # what is refused is published as it is
        if self._control is None or not self._control.is_free:
            return
        self._parameters.change(self._requests, part, {parameter: changed.get_value()})

    def _values(self) -> dict[str, Any]:
        """Return the values of all parameters, '<part>.<name>'."""
        return {
            f"{part}.{name}": _value(kind, text)
            for part, reply in tuple(self._parameters.known.items())
            for name, kind, text in zip(reply.names, reply.types, reply.values, strict=True)
        }

    def _publish_joints(self, stamp: Timestamp) -> None:
        self._joints.read()
        message = self._joints.message
        columns = {
            field: values.tolist()
            for field in ("position", "velocity", "effort")
            if (values := getattr(message, field, None)) is not None
        }
        joints = [
            JointState(name=name, **{field: values[index] for field, values in columns.items()})
            for index, name in enumerate(message.names)
        ]
        self._joint_states.log(JointStates(timestamp=stamp, joints=joints))

    def _publish_odometry(self, stamp: Timestamp) -> None:
        if not self._odometry.read():
            return
        message = self._odometry.message
        pose = Pose(position=_vector(message.position), orientation=_quaternion(message.orientation))
        self._odom.log(Odometry(timestamp=stamp, frame_id=message.frame, body_frame_id=message.child, pose=pose))


def _vector(numbers: np.ndarray) -> Vector3:
    x, y, z = numbers.tolist()
    return Vector3(x=x, y=y, z=z)


def _quaternion(numbers: np.ndarray) -> Quaternion:
    x, y, z, w = numbers.tolist()
    return Quaternion(x=x, y=y, z=z, w=w)


def _arrow(force: ContactForce) -> ArrowPrimitive:
    """Return the arrow of a force; without a rotation it points along x."""
    size = float(np.linalg.norm(force.force))
    x, y, z = (force.force / size).tolist()
    half = np.array((0.0, -z, y, 1.0 + x))
    quaternion = half / np.linalg.norm(half) if x > -1.0 else np.array((0.0, 0.0, 1.0, 0.0))
    red, green, blue = FORCE_COLOR
    return ArrowPrimitive(
        pose=Pose(position=_vector(force.position), orientation=_quaternion(quaternion)),
        shaft_length=FORCE_SCALE * size,
        shaft_diameter=0.024,
        head_length=0.06,
        head_diameter=0.06,
        color=Color(r=red, g=green, b=blue, a=1.0),
    )


def _value(kind: str, text: str) -> Any:
    try:
        value = json.loads(text)
    except ValueError:
        return text
    return float(value) if kind == "number" else value
