"""The PyBullet world: ground, things on it, friction."""
