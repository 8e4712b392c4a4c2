"""What plugins of one process share: Robots, and the shared space (section 2.3 of the paper)."""
