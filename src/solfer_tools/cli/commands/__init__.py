"""Sub-commands beyond those of `solfer.cli.commands`, each with its arguments."""
