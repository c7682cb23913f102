// From an axis to vertices: p + R (c r_cp + a r) in millimetres, the line that softnlp/mesh/display.py is written around.

// mesh: station, centre, around, radius, normal as unpacked. tube: { axis (p, q at each station), circle, radii }, of which
// the last two are numbers, or one for each station.
export function expand(mesh, tube, position, normal) {
  const { station, centre, around, radius } = mesh;
  const frames = stationFrames(tube.axis);
  const along = (values, at) => (typeof values === "number" ? values : values[at]);
  const scale = 1 / 127;
  for (let v = 0, i = 0, j = 0; v < station.length; v++, i += 3, j += 2) {
    const f = 12 * station[v];
    const r = along(tube.radii[radius[v]], station[v]);
    const circle = along(tube.circle, station[v]);
    const x = centre[j] * circle + around[j] * r;
    const y = centre[j + 1] * circle + around[j + 1] * r;
    for (let k = 0; k < 3; k++) position[i + k] = frames[f + k] + frames[f + 3 + k] * x + frames[f + 6 + k] * y;
    if (!normal) continue;
    const a = mesh.normal[i] * scale;
    const b = mesh.normal[i + 1] * scale;
    const c = mesh.normal[i + 2] * scale;
    for (let k = 0; k < 3; k++) {
      normal[i + k] = frames[f + 3 + k] * a + frames[f + 6 + k] * b + frames[f + 9 + k] * c;
    }
  }
}

// Twelve numbers a station: position, then the three body axes.
export function stationFrames(axis) {
  const count = axis.length / 7;
  const out = new Float32Array(12 * count);
  for (let s = 0; s < count; s++) {
    const [px, py, pz, x, y, z, w] = axis.subarray(7 * s, 7 * s + 7);
    out.set(
      [
        ...[px, py, pz],
        ...[1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        ...[2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        ...[2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
      ],
      12 * s,
    );
  }
  return out;
}
