"""Tags of the component `odometry`."""

import logging
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from solfer.components.filter_tags import FilterTags
from solfer.config import LIVE, ComparedWith, NameOf, Record
from solfer.config.records.bounds import DURATION, LENGTH, Bounds
from solfer.throttle import Throttle

throttle = Throttle(logging.getLogger(__name__))

SPEED: Bounds = {"ge": 1e-6, "le": 100.0}
"""Bounds of speeds that are compared or weigh [m/s, rad/s]."""


def _replaced(method: object) -> object:
    """Return the method that has replaced one of an earlier release."""
    if method != "rolling":
        return method
    throttle.warning(method, "odometry: `method: rolling` is no more, `method: filter` takes its place")
    return "filter"


class OdometryTags(Record):
    """Tags of `Odometry`."""

    chain: Annotated[str, NameOf("group")] = Field("wheels", description="SRDF group of the wheels or feet")
    method: Annotated[Literal["geometric", "filter"], BeforeValidator(_replaced)] = Field(
        "geometric",
        description="`geometric`: all wheels roll on flat ground, as in the paper; `filter`: a Kalman filter with "
        "covariances; wheels that slip or are lifted are left out, the gyroscope's bias is estimated, the ground may "
        "rise",
    )
    wheel_radius: Annotated[float | None, ComparedWith("radius")] = Field(
        None, **LENGTH, description="radius of the wheels [m]; default: ring and tube of their contacts"
    )
    filter: FilterTags | None = Field(None, description="low-pass filter of the angular velocity that the IMU measures")
    velocity: FilterTags | None = Field(None, description="low-pass filter of the base's velocity and of its turn")
    slip: Annotated[float, ComparedWith(factor=10.0)] = Field(
        0.03, **SPEED, **LIVE, description="filter: a wheel slips that moves this much against the others [m/s]"
    )
    slip_share: Annotated[float, ComparedWith(factor=10.0)] = Field(
        0.1, ge=0.0, le=10.0, **LIVE, description="filter: the same as a share of the robot's speed, which is added"
    )
    slip_time: Annotated[float, ComparedWith(factor=10.0)] = Field(
        0.02, **DURATION, description="filter: time over which ways are compared for that [s]"
    )
    clearance: float = Field(
        0.01, **LENGTH, **LIVE, description="filter: a wheel is lifted that has risen this much above the ground [m]"
    )
    forces: bool = Field(
        False,
        description="filter: whether wheels count by the forces on their contacts, which a pipe has to bring; of feet "
        "they are else those of the joints' torques",
    )
    touch: float = Field(
        30.0,
        ge=0.0,
        le=1e5,
        **LIVE,
        description="filter: with `forces`, and of feet, normal force below which a wheel or foot does not count; of "
        "feet at most a tenth of the weight [N]",
    )
    level: float = Field(1.5, ge=0.0, le=90.0, description="filter: slope up to which ground counts as level [deg]")
    settle: float = Field(
        0.2, **DURATION, **LIVE, description="filter: time in which the height on level ground settles [s]"
    )
    gyro_noise: float = Field(
        9e-5, ge=1e-9, le=10.0, description="filter: density of the gyroscope's white noise [rad/s/sqrt(Hz)]"
    )
    gyro_bias: float = Field(
        5e-3, ge=0.0, le=10.0, description="filter: deviation of the gyroscope's bias at the start [rad/s]"
    )
    gyro_walk: float = Field(1e-6, ge=0.0, le=10.0, description="filter: random walk of that bias [rad/s/sqrt(s)]")
    acceleration: float = Field(
        3.0, ge=1e-3, le=1e3, description="filter: deviation of the base's acceleration [m/s^2]"
    )
    radius_share: float = Field(
        0.003, ge=0.0, le=0.5, description="filter: deviation of the wheels' radii, as a share of them"
    )
    tilt_deviation: float = Field(0.3, ge=0.0, le=90.0, description="filter: deviation of the IMU's tilt [deg]")
    imu_delay: Annotated[float, ComparedWith("nothing")] = Field(
        0.0, ge=-1.0, le=1.0, description="time by which stamps of the IMU are behind those of the joints [s]"
    )
    transform: bool = Field(
        False,
        description="whether the base is published to tf, in the frame `odom`; not beside a simulator or another node "
        "that publishes it there",
    )
    rest: float = Field(
        0.06, **SPEED, **LIVE, description="filter: the robot rests below this speed of all joints [rad/s]"
    )
