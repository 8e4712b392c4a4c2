"""Pictures of recordings; the only modules that import matplotlib, when something is drawn."""
