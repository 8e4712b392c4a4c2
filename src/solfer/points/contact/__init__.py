"""Contacts with the ground, the vertices of wheels, and forces of constraints."""
