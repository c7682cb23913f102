// Arrays from base64 of little-endian numbers, which every browser's machine is.
export function unpack(text, Kind) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return new Kind(bytes.buffer);
}
