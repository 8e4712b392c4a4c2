"""What `solfer view` shows, and where it comes from."""
