"""What `solfer list` prints: for each kind a function that gives rows of cells, the name first."""
