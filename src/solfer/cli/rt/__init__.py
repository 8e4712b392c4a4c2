"""Actions, recordings and tables of `solfer rt`."""
