"""What several tests of faults plugin share."""

AT_ONCE = 2
"""Cycles from a fault until the robot holds: the one in which it is seen, and the lower level's next step."""
