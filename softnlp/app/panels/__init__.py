"""Panels of the page: each builds its controls in the current slot and follows the session."""
