"""Distances between the links of one robot."""
