/** Dialog: asks about the selection or the page, and shows the talk. Focus stays inside; Escape closes it. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { TargetedKeyboardEvent, TargetedMouseEvent } from "preact";
import type { Citation } from "../connection/answers";
import { Icon } from "../controls/icons";
import type { Session } from "../store/session";
import { ExchangeView } from "./exchange_view";
import { StateView } from "./state_view";
import type { About, Talk } from "./talk";

const MOST_QUESTION = 2000;
const MOST_SHOWN = 160;

export interface DialogProps {
  readonly session: Session;
  readonly talk: Talk;
  readonly about: About;
  /** Asks about the whole page from now on. */
  readonly onWholePage: () => void;
  readonly onCite: (citation: Citation, about: About) => void;
  readonly onClose: () => void;
}

export function Dialog({ session, talk, about, onWholePage, onCite, onClose }: DialogProps) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    dialog.current?.showModal();
    dialog.current?.querySelector("textarea")?.focus();
  }, []);
  const onClick = (event: TargetedMouseEvent<HTMLDialogElement>) => {
    if (event.target === event.currentTarget) event.currentTarget.close(); // beside it: on the text
  };
  return (
    <dialog ref={dialog} class="assistant-dialog" aria-labelledby="assistant-title" onClose={onClose} onClick={onClick}>
      <div class="assistant-frame">
        <header class="assistant-head">
          <h2 id="assistant-title">AI Assistant</h2>
          {talk.exchanges.value.length > 0 && (
            <button type="button" class="button plain" onClick={() => talk.clear()}>
              Clear
            </button>
          )}
          <button type="button" class="button plain icon" aria-label="Close" onClick={() => dialog.current?.close()}>
            <Icon name="close" />
          </button>
        </header>
        <TalkView talk={talk} onCite={onCite} />
        <StateView session={session} />
        <QuestionForm session={session} talk={talk} about={about} onWholePage={onWholePage} />
      </div>
    </dialog>
  );
}

interface TalkProps {
  readonly talk: Talk;
  readonly onCite: DialogProps["onCite"];
}

function TalkView({ talk, onCite }: TalkProps) {
  const end = useRef<HTMLDivElement>(null);
  const exchanges = talk.exchanges.value;
  const last = exchanges.at(-1);
  useEffect(() => end.current?.scrollIntoView({ block: "nearest" }), [exchanges.length, last?.text]);
  return (
    <div class="assistant-talk" role="log" aria-label="Questions and answers" tabIndex={0}>
      {exchanges.map((exchange) => (
        <ExchangeView key={exchange.key} exchange={exchange} onCite={(citation) => onCite(citation, exchange.about)} />
      ))}
      <div ref={end} />
    </div>
  );
}

type FormProps = Pick<DialogProps, "session" | "talk" | "about" | "onWholePage">;

function QuestionForm({ session, talk, about, onWholePage }: FormProps) {
  const question = useSignal("");
  const mayAsk = session.isOpen.value && session.assistant.value?.running === true;
  const isWaiting = talk.exchanges.value.some(({ phase }) => phase === "waiting");
  const isWanted = useSignal(false); // asked before something answers
  const ask = () => {
    const text = question.value.trim();
    isWanted.value = text !== "" && !mayAsk;
    if (text === "" || !mayAsk || isWaiting) return;
    question.value = "";
    void talk.ask(session.questions, text, about);
  };
  useEffect(() => {
    if (mayAsk && isWanted.value) ask();
  }, [mayAsk]);
  const onKeyDown = (event: TargetedKeyboardEvent<HTMLTextAreaElement>) => {
    if (event.key !== "Enter" || event.shiftKey || event.isComposing) return;
    event.preventDefault();
    ask();
  };
  const onSubmit = (event: Event) => {
    event.preventDefault();
    ask();
  };
  return (
    <form class="assistant-form" onSubmit={onSubmit}>
      <AboutView about={about} onWholePage={onWholePage} />
      <textarea
        class="field"
        rows={2}
        maxLength={MOST_QUESTION}
        aria-label="Question"
        placeholder="Ask about the text"
        value={question.value}
        onInput={(event) => {
          question.value = event.currentTarget.value;
          isWanted.value = false;
        }}
        onKeyDown={onKeyDown}
      />
      {isWanted.value && <p class="assistant-about">Your question is asked as soon as an assistant answers.</p>}
      <button type="submit" class="button primary" disabled={!mayAsk || isWaiting}>
        Ask
      </button>
    </form>
  );
}

function AboutView({ about, onWholePage }: Pick<DialogProps, "about" | "onWholePage">) {
  const { selection, isCut, isWholePage, title } = about;
  if (selection === "" || isWholePage) {
    return (
      <p class="assistant-about">
        About the page <strong>{title}</strong>
        {isCut && ", of which the first 20 kB are read"}
      </p>
    );
  }
  return (
    <div class="assistant-about">
      <span>About your selection</span>
      <button type="button" class="button plain small" onClick={onWholePage}>
        Ask about the page instead
      </button>
      <blockquote>{selection.length > MOST_SHOWN ? `${selection.slice(0, MOST_SHOWN)}…` : selection}</blockquote>
      {isCut && <p class="warn">Your selection is longer than 20 kB: the first 20 kB are asked about.</p>}
    </div>
  );
}
