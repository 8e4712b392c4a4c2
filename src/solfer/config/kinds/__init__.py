"""Records of the kinds of pipes, a file for each kind, and the table of all."""
