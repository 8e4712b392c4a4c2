"""`solfer check --allocations`: the lines of a plugin that allocate memory in its cycle."""
