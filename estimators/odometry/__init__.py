"""Odometry: dead reckoning, or an extended Kalman filter over wheels, inertial unit and absolute poses."""
