"""What each study shows beside the robot, one module a study."""
