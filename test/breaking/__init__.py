"""Running systems that are broken on purpose: their processes, what their robot does meanwhile, and what it may do."""
