"""Obstacle futures: what those that move may do in the next seconds, as samples."""
