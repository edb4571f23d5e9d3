"""Calibration: what the samples of a drive and its true poses say of the wheels and the gyro; pure functions."""
