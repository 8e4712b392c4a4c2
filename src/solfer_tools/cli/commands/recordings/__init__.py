"""The sub-commands on recordings, one module each."""
