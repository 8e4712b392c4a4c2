"""Middlewares: they connect plugins to the outside."""
