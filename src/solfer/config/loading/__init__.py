"""Loading of modules from a main configuration: layers, sets of pipes, checks."""
