/** Navigation: another chapter takes the place of the text without a new page, so that the connection and the talk go on. */

const BODY = ".book-body";

export class Navigation {
  readonly #root: URL;
  readonly #onText: () => void;
  #shown = pathOf(location.href);

  constructor(root: URL, onText: () => void) {
    this.#root = root;
    this.#onText = onText;
    document.addEventListener("click", (event) => this.#onClick(event));
    addEventListener("popstate", () => {
      if (pathOf(location.href) !== this.#shown) void this.#show(location.href);
    });
  }

  /** Shows an address of the book; the chapter that is shown already stays. */
  async go(address: string): Promise<void> {
    if (pathOf(address) === this.#shown) return;
    history.pushState(null, "", address);
    await this.#show(address);
  }

  #onClick(event: MouseEvent): void {
    const link = event.target instanceof Element ? event.target.closest<HTMLAnchorElement>("a[href]") : null;
    const isPlain = event.button === 0 && !event.ctrlKey && !event.metaKey && !event.shiftKey && !event.altKey;
    if (link === null || !isPlain || event.defaultPrevented || link.target !== "") return;
    const isChapter = link.href.startsWith(this.#root.href) && pathOf(link.href).endsWith(".html");
    if (!isChapter || pathOf(link.href) === this.#shown) return;
    event.preventDefault();
    void this.go(link.href);
  }

  async #show(address: string): Promise<void> {
    const found = await pageAt(address);
    const [now, next] = [document.querySelector(BODY), found?.querySelector(BODY)];
    if (found === undefined || now === null || next === null || next === undefined) {
      location.assign(address); // the server is away, or has something else there: the browser says so
      return;
    }
    this.#shown = pathOf(address);
    document.title = found.title;
    now.replaceWith(document.adoptNode(next));
    this.#onText();
    const { hash } = new URL(address);
    const target = hash === "" ? null : document.getElementById(decodeURIComponent(hash.slice(1)));
    if (target === null) scrollTo(0, 0);
    else target.scrollIntoView();
    if (document.querySelector("dialog[open]") === null) document.getElementById("text")?.focus({ preventScroll: true });
  }
}

async function pageAt(address: string): Promise<Document | undefined> {
  try {
    const answer = await fetch(address);
    return answer.ok ? new DOMParser().parseFromString(await answer.text(), "text/html") : undefined;
  } catch {
    return undefined;
  }
}

/** Returns an address without its fragment. */
function pathOf(address: string): string {
  const url = new URL(address, location.href);
  url.hash = "";
  return url.href;
}
