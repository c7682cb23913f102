"""How far simulations are from measurements: statistics of errors, and whole comparisons."""
