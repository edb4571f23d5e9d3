"""Planners, routers and shields, each behind its contract; one folder a planner."""
