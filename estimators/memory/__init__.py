"""What is remembered of the cells around the robot."""
