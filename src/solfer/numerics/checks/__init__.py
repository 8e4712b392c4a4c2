"""Compiled checks of what sensors measure, each with what it remembers in an array of named rows."""
