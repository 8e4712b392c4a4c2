"""Lock-step of a simulation with the nodes that follow it."""
