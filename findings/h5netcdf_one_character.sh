#!/usr/bin/env bash
# h5netcdf gives a text attribute as `str`, unless the text has one character or none: then it is `bytes`. The unit
# "1", which CF gives every number without a dimension, therefore comes back as b"1" and is unequal to "1", while "mm"
# in the variable beside it is text. The file is netCDF4-python's, which reads both back as text.
#
# Versions: h5netcdf 1.8.2, h5py 3.16.0, netCDF4 1.7.5.1.post1, NumPy 2.4.6; Python 3.11.
# Seen:
#   netCDF4 'mm' '1'
#   h5netcdf 'mm' b'1'
# The script ends with 1 when this is no longer so.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    h5netcdf==1.8.2 h5py==3.16.0 netCDF4==1.7.5.1.post1 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - > seen.txt <<'PYTHON'
import h5netcdf
import netCDF4

with netCDF4.Dataset("a.nc", "w") as file:
    for name, unit in (("length", "mm"), ("stretch", "1")):
        file.createVariable(name, "f8", ()).units = unit
with netCDF4.Dataset("a.nc") as file:
    print("netCDF4", *(repr(file[name].units) for name in ("length", "stretch")))
with h5netcdf.File("a.nc") as file:
    plain = [value.item() if hasattr(value, "item") else value for value in
             (file[name].attrs["units"] for name in ("length", "stretch"))]
    print("h5netcdf", *map(repr, plain))
PYTHON
cat seen.txt
diff seen.txt - <<'SEEN' || exit 1
netCDF4 'mm' '1'
h5netcdf 'mm' b'1'
SEEN
