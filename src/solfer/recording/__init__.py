"""Recordings: what a run measured, desired and sent, and the MCAP file that holds it."""
