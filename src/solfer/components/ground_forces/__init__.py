"""What the ground does to the robot, from the efforts of its joints."""

from solfer.components.ground_forces.component import GroundForces

__all__ = ["GroundForces"]
