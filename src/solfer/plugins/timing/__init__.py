"""When a plugin's cycles run: its loop, the time of the robot, and what it leaves out."""
