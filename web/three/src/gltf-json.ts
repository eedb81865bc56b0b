/** `glTF`, which binary files begin with. */
const MAGIC = 0x46546c67;
/** Bytes before the JSON of a binary file: its head, and its first chunk's. */
const HEAD = 20;

/**
 * Reads a glTF file's JSON, and of a binary file no more than that: its geometry and pictures may be
 * large.
 */
export async function readGltfJson(url: string): Promise<unknown> {
  const response = await fetch(url);
  if (!response.ok || !response.body) throw new Error(`${url} cannot be read (HTTP ${response.status})`);
  const reader = response.body.getReader();
  let bytes = new Uint8Array(0);
  let end = Infinity;
  while (bytes.length < end) {
    const { value, done } = await reader.read();
    if (done) break;
    bytes = joined(bytes, value);
    const view = new DataView(bytes.buffer);
    if (end === Infinity && bytes.length >= HEAD && view.getUint32(0, true) === MAGIC)
      end = HEAD + view.getUint32(12, true);
  }
  await reader.cancel();
  const text = bytes.subarray(end === Infinity ? 0 : HEAD, Math.min(end, bytes.length));
  return JSON.parse(new TextDecoder().decode(text).replace(/\0+$/, ''));
}

function joined(a: Uint8Array, b: Uint8Array): Uint8Array<ArrayBuffer> {
  const both = new Uint8Array(a.length + b.length);
  both.set(a);
  both.set(b, a.length);
  return both;
}
