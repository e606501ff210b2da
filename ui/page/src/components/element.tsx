/** Element: a panel as a custom element, in a shadow root with the page's styles. */

import { render } from "preact";
import { useEffect, useState } from "preact/hooks";
import type { Panel, Settings } from "../panels/panel";
import type { Session } from "../store/session";
import { errorText } from "../store/text";
import { release, share } from "./sessions";

/** Attributes of an element; those that are missing are undefined. */
export type Attributes = Readonly<Record<string, string | undefined>>;

export interface Embedded {
  readonly component: Panel["component"];
  readonly attributes: readonly string[];
  readonly settingsOf: (attributes: Attributes) => Settings;
}

const HOST = ":host { display: block; min-height: 320px; } :host(busflow-parameter) { min-height: 0; } .embedded { display: flex; flex-direction: column; height: 100%; min-height: inherit; container-type: inline-size; }";
const ORIGIN = new URL(".", import.meta.url).href;
let styles: Promise<CSSStyleSheet> | undefined;

/** Defines an element of a name, once. */
export function define(name: string, embedded: Embedded): void {
  if (customElements.get(name) === undefined) customElements.define(name, elementOf(embedded));
}

function elementOf(embedded: Embedded): CustomElementConstructor {
  return class extends HTMLElement {
    static readonly observedAttributes = ["server", "token", ...embedded.attributes];
    readonly #root = this.attachShadow({ mode: "open" });
    #session: Session | undefined;
    #key = "";

    connectedCallback(): void {
      const update = (): void => {
        if (this.isConnected) this.#update();
      };
      // A plot takes its colours from the styles; without them the panel is plain, and works.
      void adopt(this.#root).then(update, update);
    }

    disconnectedCallback(): void {
      render(null, this.#root);
      this.#leave();
    }

    attributeChangedCallback(): void {
      if (this.isConnected) this.#update();
    }

    #update(): void {
      const [server, token] = [this.getAttribute("server") ?? ORIGIN, this.getAttribute("token") ?? ""];
      try {
        this.#join(server, token);
      } catch (error) {
        render(<p role="alert">{errorText(error)}</p>, this.#root);
        return;
      }
      const attributes = Object.fromEntries(embedded.attributes.map((each) => [each, this.getAttribute(each) ?? undefined]));
      if (this.#session !== undefined) render(<Content session={this.#session} embedded={embedded} attributes={attributes} />, this.#root);
    }

    #join(server: string, token: string): void {
      if (this.#session !== undefined && this.#key === `${server} ${token}`) return;
      this.#leave();
      this.#session = share(server, token);
      this.#key = `${server} ${token}`;
    }

    #leave(): void {
      if (this.#session !== undefined) release(this.#session);
      this.#session = undefined;
    }
  };
}

interface ContentProps {
  readonly session: Session;
  readonly embedded: Embedded;
  readonly attributes: Attributes;
}

function Content({ session, embedded, attributes }: ContentProps) {
  const begin = embedded.settingsOf(attributes);
  const key = JSON.stringify(begin);
  const [settings, setSettings] = useState<Settings>(begin);
  useEffect(() => setSettings(JSON.parse(key) as Settings), [key]);
  const state = session.state.value;
  const fault = state.phase === "refused" || state.phase === "waiting" ? state.reason : undefined;
  const Body = embedded.component;
  return (
    <div class="embedded">
      {fault !== undefined && (
        <p class="bad small" role="alert">
          {fault}
        </p>
      )}
      <Body session={session} settings={settings} onSettings={setSettings} />
    </div>
  );
}

/** Gives a shadow root the styles of the page; constructable sheets need no exception in a page's CSP. */
async function adopt(root: ShadowRoot): Promise<void> {
  const host = new CSSStyleSheet();
  host.replaceSync(HOST);
  root.adoptedStyleSheets = [host];
  styles ??= fetchStyles();
  root.adoptedStyleSheets = [await styles, host];
}

async function fetchStyles(): Promise<CSSStyleSheet> {
  const answer = await fetch(new URL("app.css", import.meta.url));
  if (!answer.ok) throw new Error(`the styles of the panels cannot be loaded: ${answer.status} of ${answer.url}`);
  return new CSSStyleSheet().replace(await answer.text());
}
