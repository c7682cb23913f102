"""Machine code from symbolic functions: Runge-Kutta steps and maps over many columns; it knows no robot."""
