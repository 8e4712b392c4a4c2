"""The life of the plugins of one loop: states, budgets, switching on and off, joints that two of them claim."""
