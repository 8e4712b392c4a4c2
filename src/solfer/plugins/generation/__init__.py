"""From a configuration to a plugin: find the component, share measurements, check."""
