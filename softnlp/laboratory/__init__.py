"""Files as laboratories write them: read as they are, with each guess named, to columns in SI units."""
