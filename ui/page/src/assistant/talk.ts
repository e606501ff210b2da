/** Talk: the questions of this tab with their answers, kept while the reader goes on to other chapters. */
import { signal, type ReadonlySignal } from "@preact/signals";
import type { AssistantAnswer } from "../connection/answers";
import type { Questions } from "../connection/questions";
import { limits } from "../limits";
import { errorText } from "../store/text";

/** What a question is about. */
export interface About {
  /** The chapter's name in the book; empty on pages of other sites. */
  readonly chapter: string;
  readonly title: string;
  /** Selected text; empty where the page is meant. */
  readonly selection: string;
  readonly isCut: boolean;
  /** Whether the selection stands for the whole page, whose Markdown the assistant does not have. */
  readonly isWholePage: boolean;
}

export interface Exchange {
  readonly key: number;
  readonly question: string;
  readonly about: About;
  /** What has come so far, or the reason why there is no answer. */
  readonly text: string;
  readonly phase: "waiting" | "answered" | "failed";
  readonly answer?: AssistantAnswer;
}

/** What stores text for this tab, such as sessionStorage. */
export type TextStorage = Pick<Storage, "getItem" | "setItem">;

const KEY = "busflow-talk";
const MOST = 50;

export class Talk {
  readonly #exchanges = signal<readonly Exchange[]>([]);
  readonly #storage: TextStorage;
  #keys = 0;

  constructor(storage: TextStorage) {
    this.#storage = storage;
    this.#exchanges.value = restored(storage);
    this.#keys = Math.max(0, ...this.#exchanges.value.map(({ key }) => key));
  }

  get exchanges(): ReadonlySignal<readonly Exchange[]> {
    return this.#exchanges;
  }

  async ask(questions: Pick<Questions, "ask">, question: string, about: About): Promise<void> {
    const key = (this.#keys += 1);
    const asked: Exchange = { key, question, about, text: "", phase: "waiting" };
    this.#set([...this.#exchanges.value, asked].slice(-MOST));
    const { selection, chapter } = about;
    let text = "";
    const onPart = (part: unknown): void => {
      text += partText(part);
      this.#change(key, { text });
    };
    try {
      const answer = await questions.ask("ask_assistant", { question, selection, chapter }, limits.assistant, onPart);
      this.#change(key, { text: answer.answer, phase: "answered", answer });
    } catch (error) {
      this.#change(key, { text: errorText(error), phase: "failed" });
    }
  }

  clear(): void {
    this.#set([]);
  }

  #change(key: number, change: Partial<Exchange>): void {
    this.#set(this.#exchanges.value.map((each) => (each.key === key ? { ...each, ...change } : each)));
  }

  #set(exchanges: readonly Exchange[]): void {
    this.#exchanges.value = exchanges;
    try {
      this.#storage.setItem(KEY, JSON.stringify(exchanges));
    } catch {
      // The browser keeps no more for this site: the talk lasts as long as the page.
    }
  }
}

function partText(part: unknown): string {
  const { text } = part as { readonly text?: unknown };
  return typeof text === "string" ? text : "";
}

/** Returns what was kept; a question that was under way when the page was left has no answer any more. */
function restored(storage: TextStorage): readonly Exchange[] {
  try {
    const kept: unknown = JSON.parse(storage.getItem(KEY) ?? "[]");
    if (!Array.isArray(kept)) return [];
    return (kept as Exchange[]).map((each) =>
      each.phase === "waiting" ? { ...each, phase: "failed", text: "The page was left before the answer came." } : each,
    );
  } catch {
    return [];
  }
}
