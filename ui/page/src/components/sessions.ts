/** Sessions of embedded elements: one connection for each server and token of a page, open while an element stands. */

import { Session } from "../store/session";

interface Shared {
  readonly session: Session;
  uses: number;
}

const SHARED = new Map<string, Shared>();

/** Returns the address of a server's WebSocket, such as `ws://127.0.0.1:8766/ws`; throws where `server` is no address of one. */
export function socketAddress(server: string): string {
  const url = new URL("ws", server.endsWith("/") ? server : `${server}/`);
  if (!/^(https?|wss?):$/.test(url.protocol)) throw new Error(`the server is http://… or https://…, got ${server}`);
  url.protocol = url.protocol.replace("http", "ws");
  url.hash = url.search = "";
  return url.href;
}

/** Takes part in the connection to a server; give it back with `release`. */
export function share(server: string, token: string): Session {
  const key = `${server} ${token}`;
  let shared = SHARED.get(key);
  if (shared === undefined) {
    shared = { session: new Session({ url: socketAddress(server), token }), uses: 0 };
    SHARED.set(key, shared);
    shared.session.connect();
  }
  shared.uses += 1;
  return shared.session;
}

/** Gives a connection back; with the last one it is closed. */
export function release(session: Session): void {
  for (const [key, shared] of SHARED) {
    if (shared.session !== session) continue;
    shared.uses -= 1;
    if (shared.uses > 0) return;
    SHARED.delete(key);
    session.close();
  }
}
