/** The search of a book: a field in the head, and the places found below it. */
import { search, type Hit, type Section } from "./search";

let sections: Promise<readonly Section[]> | undefined;

/** Puts the search into the head of a page. `go` follows a link of the result. */
export function addSearch(tools: Element, root: URL): void {
  const form = document.createElement("form");
  form.className = "book-search";
  form.role = "search";
  const field = document.createElement("input");
  Object.assign(field, { type: "search", className: "field", placeholder: "Search (/)", autocomplete: "off" });
  field.setAttribute("aria-label", "Search the book");
  const results = document.createElement("div");
  results.className = "book-results";
  results.hidden = true;
  const close = (): void => {
    results.hidden = true;
  };
  const look = async (): Promise<void> => {
    const query = field.value;
    sections ??= load(root);
    try {
      show(results, query, search(await sections, query), root);
    } catch {
      sections = undefined; // the server is away: the next letter tries again
      show(results, query, [], root);
    }
  };
  field.addEventListener("input", () => void look());
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    results.querySelector("a")?.click();
  });
  form.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    field.value = "";
    close();
    field.focus();
  });
  results.addEventListener("click", (event) => {
    if (event.target instanceof Element && event.target.closest("a") !== null) close();
  });
  document.addEventListener("click", (event) => {
    if (event.target instanceof Node && !form.contains(event.target)) close();
  });
  document.addEventListener("keydown", (event) => {
    const isTyping = event.target instanceof Element && event.target.closest("input, textarea, select, dialog") !== null;
    if (event.key !== "/" || isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    field.focus();
  });
  form.append(field, results);
  tools.append(form);
}

/** Loads the text of the book, as a script, which also a page without a server may. */
function load(root: URL): Promise<readonly Section[]> {
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = new URL("search.js", root).href;
    script.addEventListener("load", () => resolve((globalThis as { busflowBook?: readonly Section[] }).busflowBook ?? []));
    script.addEventListener("error", () => reject(new Error("the text of the book cannot be loaded")));
    document.head.append(script);
  });
}

function show(results: HTMLElement, query: string, hits: readonly Hit[], root: URL): void {
  results.hidden = query.trim() === "";
  const said = document.createElement("p");
  said.className = "book-found";
  said.role = "status";
  said.textContent = hits.length === 0 ? "Nothing found" : `${hits.length} ${hits.length === 1 ? "place" : "places"}`;
  const list = document.createElement("ul");
  list.append(...hits.map((hit) => line(hit, root)));
  results.replaceChildren(said, list);
}

function line({ section, excerpt: [before, word, after] }: Hit, root: URL): HTMLElement {
  const item = document.createElement("li");
  const link = document.createElement("a");
  link.href = new URL(section.address, root).href;
  const title = document.createElement("strong");
  title.textContent = section.heading === section.chapter ? section.chapter : `${section.heading} · ${section.chapter}`;
  const text = document.createElement("span");
  const found = document.createElement("mark");
  found.textContent = word;
  text.append(before, found, after);
  link.append(title, text);
  item.append(link);
  return item;
}
