"""`trundle doctor`: what must be known of a machine and its devices before motion is allowed."""
