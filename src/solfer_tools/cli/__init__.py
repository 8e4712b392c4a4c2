"""The `solfer` command with all its sub-commands."""
