/** What every page of a book has, with a server or without: the theme, the search, the button that copies code. */
import { effect } from "@preact/signals";
import { limits } from "../limits";
import { applyTheme, nextTheme, theme } from "../shell/theme";
import { copiedText } from "./copying";
import { addSearch } from "./search_box";

/** The first folder of the book, whatever page is open. */
export function rootOfBook(): URL {
  return new URL(`./${document.body.dataset.root ?? ""}`, location.href);
}

/** Adds the controls of the head, once. */
export function addControls(root: URL): void {
  applyTheme();
  const tools = document.querySelector(".book-tools");
  if (tools !== null) {
    addSearch(tools, root);
    tools.append(chaptersButton(), themeButton());
  }
}

/** Adds a button to each block of code of a text that was just shown. */
export function addCopyButtons(text: ParentNode): void {
  for (const figure of text.querySelectorAll<HTMLElement>("figure.code")) figure.append(copyButton(figure));
}

function themeButton(): HTMLElement {
  const button = plainButton("");
  effect(() => {
    button.textContent = { auto: "Theme: system", light: "Theme: light", dark: "Theme: dark" }[theme.value];
  });
  button.addEventListener("click", nextTheme);
  return button;
}

/** Shows and hides the chapters where the screen is narrow. */
function chaptersButton(): HTMLElement {
  const button = plainButton("Chapters");
  button.classList.add("book-menu");
  const set = (isOpen: boolean): void => {
    document.body.classList.toggle("with-chapters", isOpen);
    button.setAttribute("aria-expanded", String(isOpen));
  };
  set(false);
  button.addEventListener("click", () => set(button.getAttribute("aria-expanded") !== "true"));
  document.addEventListener("click", (event) => {
    if (event.target instanceof Element && event.target.closest(".book-chapters a") !== null) set(false);
  });
  return button;
}

function plainButton(text: string): HTMLButtonElement {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "button plain";
  button.textContent = text;
  return button;
}

function copyButton(figure: HTMLElement): HTMLElement {
  const button = plainButton("Copy");
  button.classList.add("code-copy");
  button.addEventListener("click", () => {
    const code = figure.querySelector("code");
    if (code === null) return;
    navigator.clipboard.writeText(copiedText(code.textContent, code.dataset.language)).then(
      () => {
        button.textContent = "Copied";
        setTimeout(() => (button.textContent = "Copy"), limits.copied);
      },
      () => getSelection()?.selectAllChildren(code), // the browser forbids it: the code is selected, for Ctrl-C
    );
  });
  return button;
}
