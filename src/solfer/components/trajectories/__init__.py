"""Joint-space trajectories: their messages, what is wrong with one, and joints that follow it."""
