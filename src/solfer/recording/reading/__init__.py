"""Reads recordings: records of a file, rows of topics, and pieces of what is long."""
