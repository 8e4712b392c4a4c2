"""What is compiled: a program of points as numbers, and the kernel that works it off."""
