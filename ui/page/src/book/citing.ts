/** Showing of a citation: its chapter, its text marked, in view. */
import type { Citation } from "../connection/answers";
import { rangeWith } from "../assistant/finding";
import { mark, rangesOf, unmark } from "../assistant/places";
import type { About } from "../assistant/talk";
import type { Navigation } from "./navigation";

/** Returns the address of a chapter's page, as the server makes it. */
export function addressOf(chapter: string, root: URL): string {
  const page = chapter.replace(/\.(md|markdown)$/i, ".html");
  return new URL(page.split("/").map(encodeURIComponent).join("/"), root).href;
}

/** Turns to the chapter of a citation and marks it; text of a selection is looked for in the chapter that it was made in. */
export async function showCitation(citation: Citation, about: About, navigation: Navigation, root: URL): Promise<void> {
  const chapter = citation.chapter ?? about.chapter;
  if (chapter !== "") await navigation.go(addressOf(chapter, root));
  const text = document.querySelector("article");
  if (text === null) return;
  unmark(document);
  const hasPlace = citation.page !== "" && citation.start >= 0;
  const ranges = hasPlace ? rangesOf(text, citation.start, citation.end) : [rangeWith(text, citation.text)];
  const first = mark(ranges.filter((range) => range !== undefined));
  const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  first?.scrollIntoView({ block: "center", behavior: isCalm ? "auto" : "smooth" });
}
