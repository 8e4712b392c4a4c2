"""What the sub-commands on recordings print."""
