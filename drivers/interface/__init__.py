"""What all of Trundle shares: samples, commands, mission, device contracts, geometry, kinematics, clock, seeds, errors."""
