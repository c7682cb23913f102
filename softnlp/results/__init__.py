"""What a run leaves behind: JSON, netCDF, CSV, a table for the terminal, and a view that figures are drawn from.

Files carry the unit in the name of a number; the package itself stays in SI.
"""

from softnlp.base.files import write_whole
from softnlp.results.body import Body, body_of_pose
from softnlp.results.dataset import netcdf_bytes, to_dataset
from softnlp.results.document import json_text
from softnlp.results.folder import (
    ContactView,
    MovingView,
    RunView,
    TargetView,
    load_run,
    save,
    view_of_dataset,
    view_of_run,
)
from softnlp.results.study import to_json
from softnlp.results.table import table_lines, table_text, write_table

__all__ = [
    "Body",
    "ContactView",
    "MovingView",
    "RunView",
    "TargetView",
    "body_of_pose",
    "json_text",
    "load_run",
    "netcdf_bytes",
    "save",
    "table_lines",
    "table_text",
    "to_dataset",
    "to_json",
    "view_of_dataset",
    "view_of_run",
    "write_table",
    "write_whole",
]
