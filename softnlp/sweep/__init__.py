"""Sweeps: thousands to millions of poses of one robot, in chunks that any worker can solve."""
