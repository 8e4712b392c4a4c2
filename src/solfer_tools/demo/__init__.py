"""The demonstration: CENTAURO changes its posture and drives; the motion is measured and drawn."""
