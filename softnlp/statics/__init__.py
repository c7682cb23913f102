"""The static equilibrium of one robot: cases, their solvers, and what is known of a pose."""
