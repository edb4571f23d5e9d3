"""Timed elastic bands."""
