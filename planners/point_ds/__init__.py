"""The point attractor of the clearance paper."""
