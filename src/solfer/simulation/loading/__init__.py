"""What every physics engine is given of a robot: a URDF with its fixed links lumped, physical inertias, and meshes that it reads."""
