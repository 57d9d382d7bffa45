// Grey PNG files of 8 bits.

const SIGNATURE = [137, 80, 78, 71, 13, 10, 26, 10];

const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k++) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

function chunk(kind: string, data: Uint8Array): Uint8Array {
  const out = new Uint8Array(12 + data.length);
  const view = new DataView(out.buffer);
  view.setUint32(0, data.length);
  for (let k = 0; k < 4; k++) out[4 + k] = kind.charCodeAt(k);
  out.set(data, 8);
  let c = 0xffffffff;
  for (let k = 4; k < 8 + data.length; k++) c = CRC[(c ^ out[k]) & 255] ^ (c >>> 8);
  view.setUint32(8 + data.length, (c ^ 0xffffffff) >>> 0);
  return out;
}

export async function greyPng(columns: number, rows: number, grey: Uint8Array): Promise<Uint8Array> {
  const head = new Uint8Array(13);
  new DataView(head.buffer).setUint32(0, columns);
  new DataView(head.buffer).setUint32(4, rows);
  head[8] = 8; // Bits; the kind of colour, 0, is grey.
  const lines = new Uint8Array(rows * (columns + 1));
  for (let r = 0; r < rows; r++) lines.set(grey.subarray(r * columns, (r + 1) * columns), r * (columns + 1) + 1);
  const packed = new Blob([lines]).stream().pipeThrough(new CompressionStream('deflate'));
  const data = new Uint8Array(await new Response(packed).arrayBuffer());
  const parts = [Uint8Array.from(SIGNATURE), chunk('IHDR', head), chunk('IDAT', data), chunk('IEND', new Uint8Array())];
  const out = new Uint8Array(parts.reduce((n, p) => n + p.length, 0));
  parts.reduce((n, p) => (out.set(p, n), n + p.length), 0);
  return out;
}

/** Number of columns of a PNG file. */
export function pngColumns(bytes: ArrayBuffer): number | null {
  const head = new Uint8Array(bytes, 0, Math.min(24, bytes.byteLength));
  return head.length === 24 && SIGNATURE.every((v, k) => head[k] === v) ? new DataView(bytes).getUint32(16) : null;
}
