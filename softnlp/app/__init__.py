"""The browser app: one scenario on the screen, the studies of the package behind it, nothing of its own in between."""
