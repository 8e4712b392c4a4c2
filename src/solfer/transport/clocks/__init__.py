"""Clocks of senders, and stamps that cannot be right."""
