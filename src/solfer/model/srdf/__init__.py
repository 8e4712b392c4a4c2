"""Semantics of an SRDF: groups and named states."""
