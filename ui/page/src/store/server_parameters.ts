/** Server parameters: those that a server of Foxglove's protocol offers, such as ROS 2's foxglove_bridge, without declarations. */
import { computed, signal, type ReadonlySignal } from "@preact/signals";
import type { Parameter, ParameterValue } from "../connection/answers";
import type { Connection } from "../connection/connection";
import type { Operation, ParameterRow, ServerMessage } from "../connection/protocol";
import { limits } from "../limits";

const ERROR = 2;
const BYTES = "byte_array";

type Rows = ReadonlyMap<string, ParameterRow>;

interface Pending {
  readonly resolve: (rows: readonly ParameterRow[]) => void;
  readonly reject: (error: Error) => void;
  readonly isSetting: boolean;
}

export class ServerParameters {
  readonly #connection: Pick<Connection, "send">;
  readonly #rows = signal<Rows>(new Map());
  readonly #pending = new Map<string, Pending>();
  #ids = 0;

  constructor(connection: Pick<Connection, "send">) {
    this.#connection = connection;
  }

  /** The nodes that have parameters, as far as the server has said. */
  readonly nodes: ReadonlySignal<readonly string[]> = computed(() => [...new Set([...this.#rows.value.keys()].map(nodeOf))].sort());

  /** Asks which parameters there are. */
  async readAll(): Promise<void> {
    await this.#request({ op: "getParameters", parameterNames: [] });
  }

  /** Returns a node's parameters as they are now; rejects where the server does not answer. */
  async read(node: string): Promise<readonly Parameter[]> {
    const ofNode = (): readonly ParameterRow[] => [...this.#rows.value.values()].filter(({ name }) => nodeOf(name) === node);
    await this.#request({ op: "getParameters", parameterNames: ofNode().map(({ name }) => name) });
    return ofNode().map(parameterOf);
  }

  /** Sets a parameter; returns why the server has refused the value, or null. */
  async set(node: string, name: string, value: ParameterValue): Promise<string | null> {
    const fullName = `${node}.${name}`;
    const type = this.#rows.value.get(fullName)?.type;
    const parameter = { name: fullName, value, ...(type === undefined ? {} : { type }) };
    const [row] = await this.#request({ op: "setParameters", parameters: [parameter] }, true);
    const isSet = row === undefined || JSON.stringify(row.value) === JSON.stringify(value);
    return isSet ? null : `The server keeps ${row.value === undefined ? "no value" : JSON.stringify(row.value)}.`;
  }

  ended(): void {
    for (const { reject } of this.#pending.values()) reject(new Error("The connection ended before the answer came."));
    this.#pending.clear();
    this.#rows.value = new Map();
  }

  handle(message: ServerMessage): void {
    if (message.op === "parameterValues") {
      this.#rows.value = new Map([...this.#rows.value, ...message.parameters.map((row) => [row.name, row] as const)]);
      this.#take(message.id)?.resolve(message.parameters);
    } else if (message.op === "status" && message.level === ERROR) {
      // A refusal has no number: it belongs to what is being set.
      const refused = [...this.#pending].find(([, { isSetting }]) => isSetting);
      this.#take(refused?.[0])?.reject(new Error(message.message));
    }
  }

  #request(operation: Operation, isSetting = false): Promise<readonly ParameterRow[]> {
    const id = `parameters-${(this.#ids += 1)}`;
    return new Promise((resolve, reject) => {
      const giveUp = (): void => this.#take(id)?.reject(new Error(`No answer within ${limits.answer / 1000} s.`));
      const timer = setTimeout(giveUp, limits.answer);
      const settled = <Found>(settle: (found: Found) => void) => (found: Found): void => {
        clearTimeout(timer);
        settle(found);
      };
      this.#pending.set(id, { resolve: settled(resolve), reject: settled(reject), isSetting });
      this.#connection.send({ ...operation, id });
    });
  }

  #take(id: string | undefined): Pending | undefined {
    const found = id === undefined ? undefined : this.#pending.get(id);
    if (id !== undefined) this.#pending.delete(id);
    return found;
  }
}

/** Returns the node of a parameter such as `/camera.exposure.auto`. */
function nodeOf(name: string): string {
  const dot = name.indexOf(".");
  return dot < 0 ? "" : name.slice(0, dot);
}

/** Returns what a form needs: the type as far as the value shows it, and nothing that only a declaration says. */
export function parameterOf({ name, value, type }: ParameterRow): Parameter {
  return {
    name: name.slice(name.indexOf(".") + 1),
    type: typeOf(value, type),
    ros_type: "",
    value: value ?? null,
    default: null,
    required: true,
    ...{ bounds: null, range: null, choices: null, description: null, source: null, at: null },
    read_only: value === undefined || type === BYTES,
  };
}

function typeOf(value: ParameterValue | undefined, type: string | undefined): string {
  if (type === "float64" || (typeof value === "number" && !Number.isInteger(value))) return "float";
  if (typeof value === "number") return "int";
  if (typeof value === "boolean") return "bool";
  return typeof value === "string" ? "str" : "list";
}
