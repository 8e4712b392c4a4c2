"""A mock of the hardware: the simulated robot behind other names, numbers, gains and delays."""
