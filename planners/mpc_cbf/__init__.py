"""Model predictive control with discrete-time control barrier functions."""
