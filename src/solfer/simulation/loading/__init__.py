"""What engines are given of a robot: a URDF with lumped links and physical inertias, and meshes that they read."""
