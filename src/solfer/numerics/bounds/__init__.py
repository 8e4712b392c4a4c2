"""Bounds of joint velocities and accelerations that keep joints in their ranges."""
