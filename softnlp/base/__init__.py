"""What everything stands on: errors, statuses, units, ranges, and reading and writing of text and files."""
