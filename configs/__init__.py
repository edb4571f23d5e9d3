"""Robots, scenarios, experiments and budgets as YAML, and robot models; package data, no code."""
