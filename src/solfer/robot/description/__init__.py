"""What describes a robot: its files and parameters, and the robots that solfer has."""
