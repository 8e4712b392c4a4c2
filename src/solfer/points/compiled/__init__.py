"""Compiled code: programs of points as numbers, and the kernel that executes them."""
