"""The `solfer` command: one module for each sub-command."""
