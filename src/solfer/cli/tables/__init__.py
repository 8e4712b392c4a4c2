"""Tables of `solfer list`: for each kind a function that yields rows of cells, the name first."""
