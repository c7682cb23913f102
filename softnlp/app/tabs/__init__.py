"""The tabs of the page, one a study: each edits its tables of the scenario and runs the package's own study."""
