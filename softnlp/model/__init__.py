"""The robot, its silicone, its section, its rod and its loads, as numbers and as symbols."""
