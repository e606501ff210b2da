/** Services: those that the server offers, and calls of them, each with a time limit. */
import { signal, type ReadonlySignal } from "@preact/signals";
import type { Connection } from "./connection";
import { callFrame, type OfferedService, type ServerMessage } from "./protocol";

/** The reason why a call has no answer, in words. */
export class CallError extends Error {}

interface Pending {
  readonly resolve: (data: DataView) => void;
  readonly reject: (error: CallError) => void;
  readonly timer: ReturnType<typeof setTimeout>;
}

export class Services {
  readonly #connection: Pick<Connection, "sendBytes">;
  readonly #offered = signal<ReadonlyMap<string, OfferedService>>(new Map());
  readonly #pending = new Map<number, Pending>();
  #ids = 0;

  constructor(connection: Pick<Connection, "sendBytes">) {
    this.#connection = connection;
  }

  /** The offered services by name. */
  get offered(): ReadonlySignal<ReadonlyMap<string, OfferedService>> {
    return this.#offered;
  }

  /** Calls a service with an encoded request; rejects with CallError where it fails or takes longer than the limit. */
  call(service: OfferedService, request: Uint8Array, limitMs: number): Promise<DataView> {
    const id = (this.#ids += 1);
    const encoding = service.request?.encoding ?? "cdr";
    return new Promise((resolve, reject) => {
      if (!this.#connection.sendBytes(callFrame(service.id, id, encoding, request))) {
        reject(new CallError("There is no connection to the run."));
        return;
      }
      const timer = setTimeout(() => {
        this.#pending.delete(id);
        reject(new CallError(`No answer within ${limitMs / 1000} s.`));
      }, limitMs);
      this.#pending.set(id, { resolve, reject, timer });
    });
  }

  ended(): void {
    for (const each of this.#pending.values()) {
      clearTimeout(each.timer);
      each.reject(new CallError("The connection ended before the answer came."));
    }
    this.#pending.clear();
    this.#offered.value = new Map();
  }

  handle(message: ServerMessage): void {
    switch (message.op) {
      case "advertiseServices": {
        const added = message.services.map((service) => [service.name, service] as const);
        this.#offered.value = new Map([...this.#offered.value, ...added]);
        break;
      }
      case "unadvertiseServices": {
        const gone = new Set(message.serviceIds);
        this.#offered.value = new Map([...this.#offered.value].filter(([, service]) => !gone.has(service.id)));
        break;
      }
      case "callAnswered":
        this.#take(message.call)?.resolve(message.data);
        break;
      case "serviceCallFailure":
        this.#take(message.callId)?.reject(new CallError(message.message));
        break;
      default:
    }
  }

  #take(id: number): Pending | undefined {
    const found = this.#pending.get(id);
    if (found === undefined) return undefined;
    this.#pending.delete(id);
    clearTimeout(found.timer);
    return found;
  }
}
