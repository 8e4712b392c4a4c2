"""Detection of a robot that is out of control."""
