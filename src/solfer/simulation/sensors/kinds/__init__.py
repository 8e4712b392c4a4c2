"""The kinds of sensors, one in each module: its topic and rate, its record, its noise, and how it measures."""
