"""The field log: what the loop consumed and decided, exactly, and what a person wants to see of it."""
