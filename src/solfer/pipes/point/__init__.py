"""Pipes that carry Robot Points between plugins."""
