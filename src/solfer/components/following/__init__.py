"""References that others give to tasks of a component, or that its configuration generates."""
