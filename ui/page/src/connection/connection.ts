/** Connection: the WebSocket to the server, opened again with a growing pause whenever it ends. */
import { backoffMs } from "./backoff";
import { readFrame, REFUSED_CODE, SUBPROTOCOLS, type Operation, type ServerMessage } from "./protocol";

export type ConnectionState =
  | { readonly phase: "connecting" }
  | { readonly phase: "open" }
  | { readonly phase: "waiting"; readonly reason: string }
  | { readonly phase: "refused"; readonly reason: string };

/** What a connection needs of a WebSocket; tests give it one of their own. */
export type Socket = Pick<
  WebSocket,
  "send" | "close" | "binaryType" | "bufferedAmount" | "onopen" | "onmessage" | "onclose"
>;

export interface ConnectionOptions {
  readonly url: string;
  readonly token: string;
  readonly onState: (state: ConnectionState) => void;
  readonly onMessage: (message: ServerMessage) => void;
  readonly open?: (url: string) => Socket;
  readonly wait?: (then: () => void, ms: number) => void;
}

const NEVER_BEFORE = "The server did not answer.";
const ENDED = "The connection to busflow ui has ended.";

export class Connection {
  readonly #options: ConnectionOptions;
  readonly #open: (url: string) => Socket;
  readonly #wait: (then: () => void, ms: number) => void;
  #socket: Socket | null = null;
  #failures = 0;
  #isClosed = false;

  constructor(options: ConnectionOptions) {
    this.#options = options;
    this.#open = options.open ?? ((url) => new WebSocket(url, SUBPROTOCOLS));
    this.#wait = options.wait ?? ((then, ms) => void setTimeout(then, ms));
  }

  /** Opens the connection, and again after each end, until `close` or until the server refuses the token. */
  connect(): void {
    if (this.#isClosed) return;
    this.#options.onState({ phase: "connecting" });
    const socket = this.#open(this.#options.url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      socket.send(JSON.stringify({ op: "busflow/hello", token: this.#options.token }));
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => this.#receive(socket, data);
    socket.onclose = ({ code, reason }) => this.#end(code, reason);
  }

  /** Sends an operation as text; it is dropped while there is no connection, whose next one begins anew. */
  send(operation: Operation): void {
    this.#socket?.send(JSON.stringify(operation));
  }

  /** Sends a binary frame; false where there is no connection. */
  sendBytes(frame: Uint8Array<ArrayBuffer>): boolean {
    this.#socket?.send(frame);
    return this.#socket !== null;
  }

  /** Number of bytes that wait to be sent. */
  get waitingBytes(): number {
    return this.#socket?.bufferedAmount ?? 0;
  }

  close(): void {
    this.#isClosed = true;
    this.#socket?.close();
  }

  #receive(socket: Socket, data: string | ArrayBuffer): void {
    const message = readFrame(data);
    if (message === null) return;
    const isFirst = message.op === "serverInfo" && this.#socket === null;
    if (isFirst) {
      this.#socket = socket;
      this.#failures = 0;
    }
    this.#options.onMessage(message);
    if (isFirst) this.#options.onState({ phase: "open" });
  }

  #end(code: number, reason: string): void {
    const wasOpen = this.#socket !== null;
    this.#socket = null;
    if (this.#isClosed) return;
    if (code === REFUSED_CODE) {
      this.#options.onState({ phase: "refused", reason });
      return;
    }
    this.#failures += 1;
    this.#options.onState({ phase: "waiting", reason: reason || (wasOpen ? ENDED : NEVER_BEFORE) });
    this.#wait(() => this.connect(), backoffMs(this.#failures));
  }
}
