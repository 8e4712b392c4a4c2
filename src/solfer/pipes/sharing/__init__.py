"""Ends of pipes whose other end is in the same process."""
