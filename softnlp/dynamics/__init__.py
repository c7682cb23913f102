"""The rod in time: inertia, damping, pressures that change, and what it swings like about a pose."""
