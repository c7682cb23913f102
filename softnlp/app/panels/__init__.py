"""The controls beside the robot, one module a group of scenario tables, and the results."""
