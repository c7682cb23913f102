#!/usr/bin/env bash
# The netCDF type of one and the same text attribute depends on the engine with which xarray writes it: `char` with
# engine "netcdf4", `string` with engine "h5netcdf", though both write format NETCDF4 and the text is "mm".
# Programs that read no attribute of type `string` (the netcdf package 1.0.16 of GNU Octave, in `ncinfo` and
# `ncreadatt`) read the first file and stop at the second.
#
# Versions: xarray 2026.9.0, h5netcdf 1.8.2, h5py 3.16.0, netCDF4 1.7.5.1.post1, NumPy 2.4.6; Python 3.11.
# Seen:
#   netcdf4: fixed length
#   h5netcdf: variable length
# The script ends with 1 when this is no longer so.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    xarray==2026.9.0 h5netcdf==1.8.2 h5py==3.16.0 netCDF4==1.7.5.1.post1 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - > seen.txt <<'PYTHON'
import h5py
import xarray as xr

for engine in ("netcdf4", "h5netcdf"):
    dataset = xr.Dataset({"length": ((), 60.0, {"units": "mm"})})
    dataset.to_netcdf(f"{engine}.nc", engine=engine, format="NETCDF4")
    with h5py.File(f"{engine}.nc") as file:
        kind = h5py.check_string_dtype(file["length"].attrs.get_id("units").dtype)
    print(f"{engine}: {'variable' if kind.length is None else 'fixed'} length")
PYTHON
cat seen.txt
diff seen.txt - <<'SEEN' || exit 1
netcdf4: fixed length
h5netcdf: variable length
SEEN
