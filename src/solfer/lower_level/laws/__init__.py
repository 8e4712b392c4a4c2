"""Joint laws, their limits, the check of commands, and their timeout."""
