"""Ground under wheels: where they have been, and floors."""
