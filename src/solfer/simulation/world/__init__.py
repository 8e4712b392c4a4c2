"""The world: ground, things on it, friction."""
