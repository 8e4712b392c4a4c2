"""Places that `wheeled_motion` follows."""

BASE_PORT, VERTICES_PORT, VELOCITIES_PORT = "base", "vertices", "vertex_velocities"
"""Inputs of the component."""

LEAD = 0.5
"""Time that places are ahead of a motion which is to be followed without a lag [s]."""
