"""The dynamic window approach."""
