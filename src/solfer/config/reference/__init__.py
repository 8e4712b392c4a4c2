"""Reference of all tags of a configuration, for editors and readers: JSON Schema and tables."""
