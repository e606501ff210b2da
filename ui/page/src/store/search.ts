/** The search over names and lines. Pure. */

/** Returns a test of names: each word of the search must occur, in any case. */
export function matcher(search: string): (name: string) => boolean {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return (name) => words.every((word) => name.toLowerCase().includes(word));
}
