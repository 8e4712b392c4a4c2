"""Joint-space pipes, with the calibration between a robot's hardware and its model."""
