/** Search: the sections of a book that have all words of a query. Pure. */

export interface Section {
  /** Its page and anchor, from the book's first folder. */
  readonly address: string;
  readonly chapter: string;
  readonly heading: string;
  readonly text: string;
}

export interface Hit {
  readonly section: Section;
  /** A part of the text with the first word in the middle. */
  readonly excerpt: readonly [before: string, word: string, after: string];
}

const MOST_HITS = 20;
const AROUND = 60;

export function search(sections: readonly Section[], query: string): readonly Hit[] {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  const [first] = words;
  if (first === undefined) return [];
  return sections
    .map((section) => ({ section, score: scoreOf(section, words) }))
    .filter(({ score }) => score > 0)
    .sort((one, other) => other.score - one.score)
    .slice(0, MOST_HITS)
    .map(({ section }) => ({ section, excerpt: excerptOf(section.text, first) }));
}

/** How well a section fits: a word of a heading counts as much as ten in the text; 0 where one is missing. */
function scoreOf({ heading, text }: Section, words: readonly string[]): number {
  const [title, body] = [heading.toLowerCase(), text.toLowerCase()];
  const scores = words.map((word) => (title.includes(word) ? 10 : 0) + Math.min(5, body.split(word).length - 1));
  return scores.includes(0) ? 0 : scores.reduce((sum, score) => sum + score, 0);
}

function excerptOf(text: string, word: string): Hit["excerpt"] {
  const at = text.toLowerCase().indexOf(word);
  if (at < 0) return [text.slice(0, 2 * AROUND), "", ""];
  const [from, to] = [Math.max(0, at - AROUND), at + word.length];
  return [(from > 0 ? "…" : "") + text.slice(from, at), text.slice(at, to), `${text.slice(to, to + AROUND)}…`];
}
