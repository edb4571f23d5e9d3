"""Routers: where the passage leads, on a larger scale than a planner looks."""
