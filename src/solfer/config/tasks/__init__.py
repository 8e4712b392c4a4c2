"""Records of stacks of tasks: points that follow references, in the order of priority, within limits."""
