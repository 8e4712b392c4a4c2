"""From the record of a stack of tasks to its tasks, its limits and its solver."""
