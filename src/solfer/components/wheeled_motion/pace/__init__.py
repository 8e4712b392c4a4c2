"""How fast motions go on, and where they have led to."""
