"""Navigation by topics alone: scenarios, references and waypoints, by a node without a robot of its own."""

from solfer_tools.navigation.course import Course, Localisation
from solfer_tools.navigation.crossing_course import CrossingCourse
from solfer_tools.navigation.navigation import Navigation
from solfer_tools.navigation.reference_course import ReferenceCourse, read_references
from solfer_tools.navigation.scenario_course import ScenarioCourse
from solfer_tools.navigation.terrain import Terrain
from solfer_tools.navigation.waypoint_course import WaypointCourse
from solfer_tools.navigation.waypoints import DriveLimits, Waypoint, WaypointFollower

__all__ = [
    "Course",
    "CrossingCourse",
    "DriveLimits",
    "Localisation",
    "Navigation",
    "ReferenceCourse",
    "ScenarioCourse",
    "Terrain",
    "Waypoint",
    "WaypointCourse",
    "WaypointFollower",
    "read_references",
]
