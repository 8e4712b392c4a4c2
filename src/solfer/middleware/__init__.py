"""Middlewares: the ways of plugins to the outside."""
