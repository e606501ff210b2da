/** Assistant: its button, beside the selection or at the corner, and its dialog. */
import { effect, signal } from "@preact/signals";
import { createRef, render } from "preact";
import type { Citation } from "../connection/answers";
import type { Session } from "../store/session";
import { Dialog } from "./dialog";
import { FloatingButton, LABEL } from "./floating_button";
import { chosenIn, type Chosen } from "./selection";
import type { About, Talk } from "./talk";

/** The page in which the button stands. */
export interface AskedPage {
  readonly session: Session;
  readonly talk: Talk;
  /** The element with the text. */
  readonly root: () => Element | null;
  /** What is asked about without a selection. */
  readonly whole: () => About;
  /** Shows a citation in the text. */
  readonly show: (citation: Citation, about: About) => void;
  /** Is called when the dialog is opened. */
  readonly onOpen?: () => void;
  /** Where the button beside a selection stands; in the text where nothing is stated. */
  readonly floating?: ParentNode;
}

/** Puts the button into an element of the page. */
export function mountAssistant(container: Element | ShadowRoot, page: AskedPage): void {
  const about = signal<About | undefined>();
  const chosen = chosenIn(page.root);
  const open = (): void => {
    page.onOpen?.();
    about.value = aboutOf(page, chosen.peek());
  };
  const floating = new FloatingButton(open);
  effect(() => {
    const [range, root] = [chosen.value?.range, page.root()];
    if (range === undefined || root === null || about.value !== undefined) floating.hide();
    else floating.show(range, root, page.floating);
  });
  const corner = createRef<HTMLButtonElement>();
  const close = (): void => {
    about.value = undefined;
    const opener = floating.element.isConnected ? floating.element : corner.current;
    opener?.focus({ preventScroll: true });
  };
  const App = () => (
    <>
      <button
        type="button"
        class="assistant-button corner"
        ref={corner}
        hidden={chosen.value !== undefined && about.value === undefined}
        aria-haspopup="dialog"
        onClick={open}
      >
        {LABEL}
      </button>
      {about.value !== undefined && (
        <Dialog
          session={page.session}
          talk={page.talk}
          about={about.value}
          onWholePage={() => (about.value = page.whole())}
          onCite={(citation, asked) => {
            if (innerWidth < NARROW) close();
            page.show(citation, asked);
          }}
          onClose={close}
        />
      )}
    </>
  );
  render(<App />, container);
}

/** Width up to which the dialog covers the text. */
const NARROW = 900;

function aboutOf(page: AskedPage, chosen: Chosen | undefined): About {
  const whole = page.whole();
  return chosen === undefined ? whole : { ...whole, selection: chosen.text, isCut: chosen.isCut, isWholePage: false };
}
