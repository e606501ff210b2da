/** Entry of the button for pages of other sites: one script tag with the token that may only ask. */
import { mountAssistant } from "./assistant";
import { rangeWith } from "./finding";
import { mark, unmark } from "./places";
import { cut } from "./selection";
import { Talk } from "./talk";
import type { Citation } from "../connection/answers";
import { socketAddress } from "../components/sessions";
import { Session } from "../store/session";
import "../styles/theme.css";
import "../styles/base.css";
import "./assistant.css";

const NAME = "busflow-assistant";
/** What holds the text of a page, the first that there is. */
const TEXTS = "[data-busflow-text], main article, article, main, body";
const SERVER = new URL(".", import.meta.url).href;

function begin(): void {
  if (document.querySelector(NAME) !== null) return;
  const script = document.querySelector<HTMLScriptElement>(`script[src="${import.meta.url}"], script[data-busflow-token]`);
  const host = document.createElement(NAME);
  const shadow = host.attachShadow({ mode: "open" });
  document.body.append(host);
  const session = new Session({ url: socketAddress(SERVER), token: script?.dataset.busflowToken ?? "" });
  let isConnected = false; // with the first question: most readers ask none
  const place = document.createElement("div");
  shadow.append(place);
  mountAssistant(place, {
    session,
    talk: new Talk(sessionStorage),
    root: textOfPage,
    floating: shadow,
    onOpen: () => {
      if (!isConnected) session.connect();
      isConnected = true;
    },
    whole: () => ({ chapter: "", title: document.title, isWholePage: true, ...wholeText() }),
    show,
  });
  void styled(shadow);
}

function textOfPage(): HTMLElement | null {
  return document.querySelector<HTMLElement>(TEXTS);
}

function wholeText(): { readonly selection: string; readonly isCut: boolean } {
  const { text, isCut } = cut(textOfPage()?.innerText ?? "");
  return { selection: text, isCut };
}

function show(citation: Citation): void {
  const root = textOfPage();
  const range = root === null ? undefined : rangeWith(root, citation.text);
  unmark(document);
  if (range !== undefined) mark([range])?.scrollIntoView({ block: "center" });
}

async function styled(root: ShadowRoot): Promise<void> {
  const answer = await fetch(new URL("assistant.css", import.meta.url));
  if (!answer.ok) throw new Error(`the styles of the assistant cannot be loaded: ${answer.status} of ${answer.url}`);
  root.adoptedStyleSheets = [await new CSSStyleSheet().replace(await answer.text())];
}

begin();
