"""Leases on joints, and refused commands."""
