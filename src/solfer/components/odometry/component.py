"""Where the base is, from wheels and IMU: the paper's `odometry3` (Listings 14 and 17, Fig. 5)."""

import logging
import math
from functools import partial
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.diagnostics import Entry, Status, Statuses
from solfer.components.filter_tags import live_filter
from solfer.components.odometry import filter_kernel
from solfer.components.odometry.feet import Feet
from solfer.components.odometry.filter import FilteredOdometry
from solfer.components.odometry.geometric import GeometricOdometry
from solfer.components.odometry.ground.ground_report import report_ground
from solfer.components.odometry.messages import (
    SetBase,
    StampedUncertainPose,
    Transforms,
    stamped_pose,
    transform,
)
from solfer.components.odometry.pose_covariances import PoseCovariances
from solfer.components.odometry.sensing.measured_base import MeasuredBase
from solfer.components.odometry.sensing.streams import Streams
from solfer.components.odometry.tags import OdometryTags
from solfer.components.odometry.wheels import Wheels
from solfer.errors import ComponentError, NotFinite
from solfer.interfaces.declaration import Accepted, LiveParameter, Parameter, Service, TopicIn, TopicOut
from solfer.interfaces.geometry import bare_frame
from solfer.interfaces.ground import GROUND, GROUND_FRAME, GroundEstimate
from solfer.model.urdf.scalar_joints import BASE_DOFS
from solfer.numerics.base_chart import BaseChart
from solfer.numerics.blocks import MemoryBlock
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion
from solfer.robot import Robot
from solfer.throttle import Throttle

log = logging.getLogger(__name__)

FRAME = GROUND_FRAME
"""World frame of the published pose, as in REP 105."""


class Odometry(Component):
    """Estimates pose and velocity of the base from wheels and IMU, and writes them into both States.

    It begins at rest above the origin of the ground, with the heading of the IMU; a service puts it elsewhere. Where
    all sensors were silent it begins again at its last place: encoders may count from elsewhere.
    The methods are `GeometricOdometry`, that of the paper, and `FilteredOdometry`.

    Args:
        robot: The Robot, with a floating base and contacts on its wheels.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        law: The method.

    Raises:
        ComponentError: The Robot has no floating base, or no wheels.
        UnknownName: It has no such group.
    """

    Tags = OdometryTags

    _INCONSISTENCY_TIME = 0.5
    """Time after which a contradiction of wheels and gyroscope is reported [s]: they slip together, or it is wrong."""

    _LONGEST_FLIGHT = 1.0
    """Time after which it is reported that no foot measures the base [s]."""

    def __init__(self, robot: Robot, tags: OdometryTags | None = None, name: str = "odometry"):
        super().__init__(robot, tags or OdometryTags(), name)
        self.modify = True
        self._wheels = wheels = Wheels(robot, self.tags.chain, self.tags.wheel_radius, where=self.tags.where("chain"))
        self.streams = Streams(robot, self.tags.imu_delay)
        self._base = MeasuredBase(robot)
        self.law: FilteredOdometry | GeometricOdometry
        if self.tags.method == "geometric":
            self.law = GeometricOdometry(robot, wheels, self._base)
        else:
            self.law = FilteredOdometry(wheels, self._base, self.tags)
        self._feet = self.law.feet if isinstance(self.law, FilteredOdometry) else None
        self._pose, self._rates = np.zeros((2, 6))
        self._rotation = np.eye(3)
        self._position = np.zeros(3)
        chart = robot.kinematics.base or BaseChart()
        self._block = MemoryBlock(
            filter_kernel.POSE,
            position=self.law.position,
            velocity=self.law.velocity,
            angular=self.law.angular,
            axes=chart.rotation,
            origin=chart.position,
            place=self._position,
            rotation=self._rotation,
            local=np.zeros(9),
            pose=self._pose,
            rates=self._rates,
        )
        self._throttle = Throttle(log)
        self._child = robot.kinematics.base_link or ""
        if self.tags.method == "filter":
            self._covariances = PoseCovariances(robot.command)

    def set_rate(self, rate: float) -> None:
        """See `Component.set_rate`.

        Raises:
            ConfigError: A filter's cut-off is not below half of the rate.
        """
        super().set_rate(rate)
        tags = self.tags
        self.law.filter = None if tags.filter is None else tags.filter.low_pass(3, rate)
        self.law.smoothing = None if tags.velocity is None else tags.velocity.low_pass(4, rate)

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer the filters, and the numbers by which wheels and ground are classified."""
        law = self.law
        rate = 1.0 / self.period
        write = law.take if isinstance(law, FilteredOdometry) else lambda _: None
        return (
            *live_filter(("filter",), law.filter, lambda tags: tags.filter.low_pass(3, rate)),
            *live_filter(("velocity",), law.smoothing, lambda tags: tags.velocity.low_pass(4, rate)),
            *(LiveParameter((key,), write) for key in ("slip", "slip_share", "touch", "clearance", "settle", "rest")),
        )

    def init(self) -> None:
        """Begin above the origin, at rest."""
        self._pose[:] = 0.0
        self.streams.start()
        self._base.averages = self.streams.synchronizes
        self._base.velocity_change = self.streams.velocity_change
        self.law.start()
        self._write()

    def update(self) -> None:
        """Follow what has been measured since the cycle before, measurement by measurement."""
        streams = self.streams
        streams.read(self.passed)
        while streams.next():
            self.model.update()
            if not streams.silence.ended:
                self.law.update(streams.elapsed, streams.measured)
            elif streams.measured:
                log.warning(
                    "%s: neither joints nor IMU were measured for %.2f s; the base goes on from where it was",
                    self.name,
                    streams.silence.ended,
                )
                streams.silence.ended = 0.0
                self.law.resume()
        streams.finish()
        self._write()
        for check in streams.stamp_checks:
            if check.warning:
                self._throttle.warning(check.warning, "%s: %s, it does not count", self.name, check.warning)
                check.warning = ""
        law = self.law
        if isinstance(law, FilteredOdometry):
            if law.consensus.contradicted > self._INCONSISTENCY_TIME:
                self._throttle.warning("inconsistency", "%s: %s", self.name, self._inconsistency())
            if law.ground.turns:
                self._distrust(law)
            feet = self._feet
            if feet is not None and feet.coasted > self._LONGEST_FLIGHT:
                self._throttle.warning("coasting", "%s: %s", self.name, self._coasting(feet))
            elif law.slip.lasts:
                self._throttle.warning("slip", "%s: %s", self.name, self._common_slip(law))
            elif law.slip.contradicted:
                self._throttle.warning(
                    "slide", "%s: wheels slide, or the accelerometer is wrong: all wheels measure otherwise", self.name
                )

    def _distrust(self, law: FilteredOdometry) -> None:
        """Let the IMU be refused, below which the ground turns: it turns on its link, or many encoders drift."""
        law.stop_tilting()
        ground = law.ground
        reason = f"the ground turns by {ground.apart[0]:.2g} rad below wheels that carry the robot"
        if not self.streams.distrust(reason, self._wheels.carrying):
            self._throttle.warning("ground", "%s: by the IMU %s; it, or joints of legs are wrong", self.name, reason)

    @staticmethod
    def _common_slip(law: FilteredOdometry) -> str:
        """Return how all wheels slip."""
        speed = math.hypot(*law.slip.slip.tolist())
        return f"all wheels slip by {speed:.2g} m/s, by the accelerometer, which the base follows"

    @staticmethod
    def _coasting(feet: Feet) -> str:
        """Return for how long no foot has measured the base."""
        return f"no foot has carried the robot for {feet.coasted:.2g} s: the accelerometer alone moves the base"

    def _inconsistency(self) -> str:
        """Return how wheels and gyroscope contradict each other; empty: they do not."""
        law = self.law
        if not isinstance(law, FilteredOdometry) or law.consensus.contradicted < self._INCONSISTENCY_TIME:
            return ""
        difference = law.consensus.contradiction
        return f"the gyroscope turns by {difference:.2g} rad/s otherwise than the wheels, which slip, or it is wrong"

    def send(self) -> None:
        """Write the base into the desired State."""
        command = self.model.command
        command.position[:6] = self._pose
        command.velocity[:6] = self._rates
        if isinstance(self.law, FilteredOdometry):
            self._covariances.write(self.law, self._rotation)

    def services(self) -> tuple[Service, ...]:
        """Offer the service `<name>/set_base`."""
        return (Service("set_base", "solfer/SetBase", SetBase, reply=Accepted, handler=self.set_base, commands=False),)

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """Receive `<name>/set_pose`; publish `<name>/pose`, `<name>/ground`, diagnostics and, by a tag, tf."""
        interface = "geometry_msgs/PoseWithCovarianceStamped"
        law = self.law
        made: list[TopicIn | TopicOut] = [TopicIn("set_pose", interface, StampedUncertainPose, handler=self.set_pose)]
        if isinstance(law, FilteredOdometry):
            made.append(
                TopicOut("/diagnostics", "diagnostic_msgs/DiagnosticArray", Statuses, self.wheel_states, rate=1.0)
            )
            made.append(TopicOut("pose", interface, StampedUncertainPose, self.uncertain_pose, rate=50.0))
            made.append(
                TopicOut("ground", GROUND, GroundEstimate, partial(report_ground, law, self._wheels), rate=10.0)
            )
        if self.tags.transform:
            made.append(TopicOut("/tf", "tf2_msgs/TFMessage", Transforms, collect=self._place))
        return tuple(made)

    def parameters(self) -> tuple[Parameter, ...]:
        """Read `tf_prefix` of the nearest namespace, in front of the base's link on tf."""
        return (Parameter("/tf_prefix", str, self._set_prefix),) if self.tags.transform else ()

    def _set_prefix(self, prefix: str) -> None:
        self._child = "/".join(part for part in (prefix.strip("/"), self._child) if part)

    def start_log(self, logger: Any) -> None:
        """Declare the base and, of the method `filter`, its deviations, and innovation and state of each wheel."""
        axes = BASE_DOFS
        places = [f"{wheel}.{axis}" for wheel in self._wheels.names for axis in "xyz"]
        logger.add("base", self._pose, axes, ("m",) * 3 + ("rad",) * 3, FRAME)
        logger.add("base_rates", self._rates, axes, ("m/s",) * 3 + ("rad/s",) * 3, FRAME)
        if isinstance(self.law, FilteredOdometry):
            logger.add("deviation", self._covariances.deviations, axes, ("m",) * 3 + ("rad",) * 3, FRAME)
            logger.add("innovation", self.law.kalman.innovations, places, "m/s")
            logger.add("rolling", self.law.kalman.rolling, self._wheels.names)

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: standard deviations of the pose."""
        if isinstance(self.law, FilteredOdometry):
            self._covariances.find_deviations()

    def _place(self) -> object:
        quaternion = quaternion_from_rotation(self._rotation)
        return transform(FRAME, self._child, self._position, quaternion=quaternion)

    def wheel_states(self) -> Statuses:
        """Return what each wheel does, with the probability that it rolls."""
        law = self.law
        entries = []
        slips = False
        assert isinstance(law, FilteredOdometry)
        for index, wheel in enumerate(self._wheels.names):
            rolls = law.consensus.inliers[index]
            lifted = law.lifted[index]
            state = "lifted" if lifted else ("rolls" if self._feet is None else "stands") if rolls else "slips"
            slips = slips or state == "slips"
            entries.append(Entry(wheel, f"{state}, probability {law.kalman.rolling[index]:.3f}"))
        inconsistency = self._inconsistency()
        common = self._common_slip(law) if law.slip.lasts else ""
        summary = common or inconsistency or ("a wheel slips" if slips else "all wheels that touch roll")
        feet = self._feet
        if feet is not None:  # which slip where they land
            slips = feet.coasted > self._LONGEST_FLIGHT
            carry = f"{law.consensus.inliers.sum()} of {len(entries)} contacts of feet carry the robot"
            summary = self._coasting(feet) if slips else carry
        return Statuses(
            status=(
                Status(
                    int(slips or bool(inconsistency)),
                    f"{self.name}: wheels",
                    summary,
                    hardware_id=self.name,
                    values=tuple(entries),
                ),
            )
        )

    def set_pose(self, message: StampedUncertainPose) -> None:
        """Put the base at a pose on the ground: position and heading count, with their variances.

        Raises:
            NotFinite: A number is NaN or infinite, or the quaternion is no orientation.
            ComponentError: The pose is in another frame than `odom`, or a variance is negative.
        """
        frame = bare_frame(message.header.frame_id)
        stamped = message.pose
        if frame not in ("", FRAME):
            raise ComponentError(f"a pose in the frame '{frame}'", expected=f"the frame '{FRAME}'")
        place = stamped.pose.position
        orientation = stamped.pose.orientation
        rotation = rotation_from_quaternion((orientation.x, orientation.y, orientation.z, orientation.w))
        variances = [stamped.covariance[7 * axis] for axis in (0, 1, 5)]
        if not all(map(math.isfinite, (place.x, place.y, *variances))):
            raise NotFinite(f"a pose at ({place.x:g}, {place.y:g})", expected="finite numbers")
        if min(variances) < 0.0:
            raise ComponentError(f"a variance of {min(variances):g}", expected="variances of zero or more")
        self.law.place(place.x, place.y, math.atan2(rotation[1, 0], rotation[0, 0]))
        if isinstance(self.law, FilteredOdometry):
            self.law.kalman.place(*variances)

    def uncertain_pose(self) -> object:
        """Return the pose of the base's origin, in the frame `odom`, and its covariance, as they were sent last."""
        quaternion = quaternion_from_rotation(self._rotation)
        return stamped_pose(FRAME, self._position, quaternion, covariance=self._covariances.pose)

    def set_base(self, request: SetBase) -> Accepted:
        """Put the base somewhere else on the ground, from the next cycle on.

        Raises:
            NotFinite: A number is NaN or infinite.
        """
        if not all(map(math.isfinite, (request.x, request.y, request.yaw))):
            raise NotFinite(
                f"the base at ({request.x:g}, {request.y:g}), turned by {request.yaw:g}", expected="finite numbers"
            )
        self.law.place(request.x, request.y, request.yaw)
        return Accepted()

    def _write(self) -> None:
        """Write where the base is now into the measured State."""
        heading = self.law.heading
        base = self._base
        state = self.model.state
        ahead = self.streams.ahead
        turned = self.streams.imu.turned
        before, after = turned or (self._position, self._position)
        yaw = heading - base.heading
        filter_kernel.write_pose(
            self._block.address, base.rotation, heading, yaw, ahead, before, after, turned is not None
        )
        state.position[:6] = self._pose
        state.velocity[:6] = self._rates
        if not base.averages:  # without histories of both
            self.streams.written()
