/** Bytes as base64, and back. Pure. */

export function base64Of(bytes: Uint8Array): string {
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
}

export function bytesOf(base64: string): DataView {
  const text = atob(base64);
  return new DataView(Uint8Array.from(text, (each) => each.charCodeAt(0)).buffer);
}
