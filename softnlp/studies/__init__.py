"""The tasks: one file each, on the same load cases."""
