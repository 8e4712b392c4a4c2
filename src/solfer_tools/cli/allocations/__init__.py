"""Which lines allocate memory in the cycle of a plugin."""
