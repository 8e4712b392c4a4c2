"""Recordings: what a run measured, wanted and sent, and the MCAP file that holds it."""
