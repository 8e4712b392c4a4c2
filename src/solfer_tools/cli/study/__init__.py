"""What `solfer study` does."""
