"""Many poses at once: shooting with few unknowns, side by side, judged by the equations of the problem itself."""
