"""A planner that asks for nothing."""
