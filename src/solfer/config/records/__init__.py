"""Records of all parts of a configuration, checked key by key (pydantic)."""
