// The permalink: the whole state, and that of a design which was kept, compressed, in the fragment of the address.

import { kept, openPair } from './compare';
import { restore, snapshot } from './state';

async function through(bytes: Uint8Array, stream: GenericTransformStream): Promise<Uint8Array> {
  const blob = new Blob([bytes as BlobPart]);
  return new Uint8Array(await new Response(blob.stream().pipeThrough(stream as ReadableWritablePair<Uint8Array, BufferSource>)).arrayBuffer());
}

export async function permalink(): Promise<string> {
  const packed = await through(new TextEncoder().encode(JSON.stringify({ ...snapshot(), a: kept.value?.state })), new CompressionStream('deflate-raw'));
  let text = '';
  packed.forEach((b) => (text += String.fromCharCode(b)));
  return btoa(text).replace(/\+/g, '-').replace(/\//g, '_').replace(/=+$/, '');
}

export async function openLink(): Promise<boolean> {
  const text = location.hash.slice(1);
  if (!text) return false;
  try {
    const packed = Uint8Array.from(atob(text.replace(/-/g, '+').replace(/_/g, '/')), (c) => c.charCodeAt(0));
    const { a, ...state } = JSON.parse(new TextDecoder().decode(await through(packed, new DecompressionStream('deflate-raw'))));
    if (a) void openPair(a, state);
    else restore(state);
    return true;
  } catch {
    return false; // A link that is cut off shows the page as it begins.
  }
}
