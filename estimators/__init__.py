"""Estimation: from what was sensed to a `Belief` about pose, free space and clearance."""
