"""What columns of tables mean that are no number of a step."""

from __future__ import annotations

WORDS: dict[str, tuple[str, str]] = {
    "step": ("", "number of the step, from 1"),
    "status": ("", "how the step ended; solved is a solution"),
    "candidate": ("", "the choices of a candidate"),
    "variant": ("", "law, coefficients, conventions and closure that were compared"),
    "count": ("", "rows that were compared"),
    "rmse": ("of the number", "root mean square of the errors"),
    "mape_%": ("%", "mean size of the errors, of the number measured; of a tip, of the robot's length"),
    "mean": ("of the number", "mean size of the errors"),
    "median": ("of the number", "median size of the errors"),
    "max": ("of the number", "largest size of the errors"),
    "bias": ("of the number", "mean of the errors with their sign"),
    "law": ("", "stress-stretch law that was fitted"),
    "R^2": ("", "share of the stress's variance that the law explains"),
    "rmse_kPa": ("kPa", "root mean square of law less data"),
    "mape_percent": ("%", "mean size of law less data, of the data"),
    "constants": ("of the key", "constants +- one standard error"),
    "constant": ("of the key", "what was identified"),
    "value": ("of the key", "its value"),
    "standard_error": ("of the key", "its standard error; more than the value is not determined"),
    "start": ("of the key", "where the search began"),
    "note": ("", "at its bound, or not determined"),
    "observable": ("", "what was measured"),
    "unit": ("", "of the next columns"),
    "numbers": ("", "how many were measured"),
    "rmse_before": ("of the number", "root mean square of the errors at the start"),
    "rmse_after": ("of the number", "and with the constants found"),
    "mape_before_percent": ("%", "mean size of the errors at the start, of the number measured"),
    "mape_after_percent": ("%", "and with the constants found"),
    "sigma": ("of the number", "standard deviation that errors were divided by"),
}
"""Columns of tables that are no number of a step: unit and meaning."""
