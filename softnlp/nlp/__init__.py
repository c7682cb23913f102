"""Posing and solving: transcriptions, problems, engines and paths; it knows no robot."""
