/** Completion: the fields that a person may mean by what is typed so far. */

/** Returns at most `most` of the candidates that contain each typed word, those that begin with the text first. */
export function completions(typed: string, candidates: readonly string[], most: number): string[] {
  const text = typed.trim().toLowerCase().replace(/^\//, "");
  const words = text.split(/\s+/).filter((word) => word !== "");
  const found = candidates.filter((each) => {
    const name = each.toLowerCase();
    return words.every((word) => name.includes(word));
  });
  const rank = (each: string): number => {
    const name = each.toLowerCase();
    if (name.startsWith(text)) return 0;
    return /(^|[^a-z0-9])$/.test(name.slice(0, name.indexOf(words[0] ?? ""))) ? 1 : 2; // where a word begins
  };
  // The header is in nearly every message, and seldom what a person wants to see.
  const isHeader = (each: string): number => (/\.header\.|covariance\[/.test(each) ? 1 : 0);
  return found
    .map((each, at) => ({ each, key: [isHeader(each), rank(each), at] as const }))
    .sort(({ key: one }, { key: other }) => one[0] - other[0] || one[1] - other[1] || one[2] - other[2])
    .slice(0, most)
    .map(({ each }) => each);
}
