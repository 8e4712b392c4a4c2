"""YAML that remembers its places: reading, strict merging, paths, and errors with file, line and column."""
