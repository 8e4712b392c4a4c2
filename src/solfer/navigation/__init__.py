"""Navigation by topics alone: scenarios, references and waypoints, by a node without a robot of its own."""

from solfer.navigation.course import Course, Localisation
from solfer.navigation.navigation import Navigation
from solfer.navigation.reference_course import ReferenceCourse, read_references
from solfer.navigation.scenario_course import ScenarioCourse
from solfer.navigation.waypoint_course import WaypointCourse
from solfer.navigation.waypoints import DriveLimits, Waypoint, WaypointFollower

__all__ = [
    "Course",
    "DriveLimits",
    "Localisation",
    "Navigation",
    "ReferenceCourse",
    "ScenarioCourse",
    "Waypoint",
    "WaypointCourse",
    "WaypointFollower",
    "read_references",
]
