"""The robot's body in a world: URDF, placement, contacts, pushes."""
