import assert from "node:assert/strict";
import { test } from "node:test";
import { Connection, type ConnectionState, type Socket } from "./connection";

/** Socket whose other end is the test. */
class TestSocket implements Socket {
  binaryType: BinaryType = "blob";
  bufferedAmount = 0;
  onopen: Socket["onopen"] = null;
  onmessage: Socket["onmessage"] = null;
  onclose: Socket["onclose"] = null;
  readonly sent: unknown[] = [];

  send(data: unknown): void {
    this.sent.push(data);
  }

  close(): void {
    this.end(1000);
  }

  accept(): void {
    this.onopen?.call(this as unknown as WebSocket, new Event("open"));
    this.say('{"op":"serverInfo","name":"lab1","capabilities":[]}');
  }

  say(data: string): void {
    this.onmessage?.call(this as unknown as WebSocket, new MessageEvent("message", { data }));
  }

  end(code: number, reason = ""): void {
    this.onclose?.call(this as unknown as WebSocket, { code, reason } as CloseEvent);
  }
}

function connected() {
  const sockets: TestSocket[] = [];
  const states: ConnectionState[] = [];
  const pauses: number[] = [];
  const next: (() => void)[] = [];
  const connection = new Connection({
    url: "ws://here/ws",
    token: "secret",
    onState: (state) => states.push(state),
    onMessage: () => undefined,
    open: () => {
      const socket = new TestSocket();
      sockets.push(socket);
      return socket;
    },
    wait: (then, ms) => {
      pauses.push(ms);
      next.push(then);
    },
  });
  connection.connect();
  return { connection, sockets, states, pauses, next };
}

test("the first message sent carries the token", () => {
  const { sockets } = connected();
  sockets[0]!.accept();
  assert.deepEqual(sockets[0]!.sent, ['{"op":"busflow/hello","token":"secret"}']);
});

test("it is open once the server has introduced itself", () => {
  const { sockets, states } = connected();
  assert.deepEqual(states, [{ phase: "connecting" }]);
  sockets[0]!.accept();
  assert.deepEqual(states.at(-1), { phase: "open" });
});

test("an ended connection is opened again", () => {
  const { sockets, states, next } = connected();
  sockets[0]!.accept();
  sockets[0]!.end(1006);
  assert.equal(states.at(-1)?.phase, "waiting");
  next.pop()!();
  sockets[1]!.accept();
  assert.deepEqual(states.at(-1), { phase: "open" });
});

test("pauses grow with failures and shrink after success", () => {
  const { sockets, pauses, next } = connected();
  for (let attempt = 0; attempt < 4; attempt += 1) {
    sockets[attempt]!.end(1006);
    next[attempt]!();
  }
  assert.ok(pauses[3]! > 2 * pauses[0]!, String(pauses));
  sockets[4]!.accept();
  sockets[4]!.end(1006);
  assert.ok(pauses[4]! < pauses[3]!, String(pauses));
});

test("a refused token is not tried again", () => {
  const { sockets, states, next } = connected();
  sockets[0]!.end(4401, "wrong token");
  assert.deepEqual(states.at(-1), { phase: "refused", reason: "wrong token" });
  assert.equal(next.length, 0);
});

test("nothing is sent without a connection", () => {
  const { connection, sockets } = connected();
  connection.send({ op: "subscribe" });
  assert.equal(connection.sendBytes(Uint8Array.of(1)), false);
  assert.deepEqual(sockets[0]!.sent, []);
});

test("closing ends all attempts", () => {
  const { connection, sockets, next } = connected();
  sockets[0]!.accept();
  connection.close();
  assert.equal(next.length, 0);
});
