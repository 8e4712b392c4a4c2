"""What pages request and command: references, the base, plugins, parameters, and the emergency stop."""
