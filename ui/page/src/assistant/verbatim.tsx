/** Verbatim: a part of a page's Markdown as text: code and emphasis are shown as such, and markup never becomes HTML. */
import type { ComponentChildren } from "preact";

const PIECE = /(`+)(?!`)(.+?)(?<!`)\1(?!`)|\*\*(.+?)\*\*|!?\[([^\]]*)\]\([^)\s]*\)|<!--[^]*?-->/;

export interface Piece {
  readonly kind: "text" | "code" | "strong";
  readonly text: string;
}

/** Splits Markdown into its pieces; of a link its text is left, of a comment nothing. */
export function piecesOf(text: string): readonly Piece[] {
  const found: Piece[] = [];
  let rest = text;
  for (let match = PIECE.exec(rest); match !== null; match = PIECE.exec(rest)) {
    const [whole, , code, strong, link] = match;
    found.push({ kind: "text", text: rest.slice(0, match.index) });
    if (code !== undefined) found.push({ kind: "code", text: code });
    else if (strong !== undefined) found.push({ kind: "strong", text: strong });
    else if (link !== undefined) found.push({ kind: "text", text: link });
    rest = rest.slice(match.index + whole.length);
  }
  return [...found, { kind: "text" as const, text: rest }].filter((piece) => piece.text !== "");
}

export function Verbatim({ text }: { readonly text: string }): ComponentChildren {
  return piecesOf(text).map(({ kind, text: piece }, index) => {
    if (kind === "code") return <code key={index}>{piece}</code>;
    return kind === "strong" ? <strong key={index}>{piece}</strong> : piece;
  });
}
