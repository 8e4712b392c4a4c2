"""The demonstration: CENTAURO changes its posture and drives, and what happened is measured and drawn."""
