"""Limits of the time of a cycle, and where a robot's time is counted."""

EARLIEST = 0.03
"""Time by which the newest stamp may be before the robot's time: messages come early [s]."""

LATEST = 0.06
"""Time by which it may be behind it: messages come late [s]."""

JUMP = 1.0
"""A stamp that jumps by this is of a clock that was set [s]."""

LOST = 0
"""Place in `RobotTime.state` of the time that has passed by the clock, and not for the robot [s]."""

ROWS = 8
"""Numbers of `RobotTime.state`."""
