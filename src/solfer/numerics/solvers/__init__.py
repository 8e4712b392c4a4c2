"""Linear systems, null spaces and quadratic programs."""
