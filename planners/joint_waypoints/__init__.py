"""A planner that takes an arm from joint way-point to joint way-point."""
