/** A question with its answer: where it is from, its citations, what answered and how long that took. */
import type { AssistantAnswer, Citation } from "../connection/answers";
import type { About, Exchange } from "./talk";
import { Verbatim } from "./verbatim";

interface ExchangeProps {
  readonly exchange: Exchange;
  readonly onCite: (citation: Citation) => void;
}

const MOST_QUOTED = 90;

export function ExchangeView({ exchange, onCite }: ExchangeProps) {
  const { question, about, text, phase, answer } = exchange;
  const kind = phase === "failed" ? "failed" : answer?.answered === false ? "refused" : phase;
  return (
    <article class="exchange" aria-busy={phase === "waiting"}>
      <h3 class="exchange-question">{question}</h3>
      <p class="exchange-about">{aboutText(about)}</p>
      <div class={`exchange-answer ${kind}`}>
        {phase === "failed" && <strong>No answer: </strong>}
        {text === "" && phase === "waiting" ? "…" : <Verbatim text={text} />}
      </div>
      {answer !== undefined && answer.citations.length > 0 && (
        <ol class="citations" aria-label="Citations">
          {answer.citations.map((citation, index) => (
            <li key={index}>
              <button type="button" class="citation" onClick={() => onCite(citation)}>
                <span class="citation-page">{citation.page === "" ? "Selection" : citation.page}</span>
                <span class="citation-text">
                  <Verbatim text={shortened(citation.text)} />
                </span>
              </button>
            </li>
          ))}
        </ol>
      )}
      {answer !== undefined && <p class="exchange-meta">{metaText(answer, about)}</p>}
    </article>
  );
}

function aboutText({ selection, title, isWholePage }: About): string {
  if (selection === "" || isWholePage) return `About ${title}`;
  return `About “${shortened(selection.replace(/\s+/g, " "))}”`;
}

function shortened(text: string): string {
  return text.length > MOST_QUOTED ? `${text.slice(0, MOST_QUOTED)}…` : text;
}

function metaText({ engine, ms, scope, answered }: AssistantAnswer, { selection, isWholePage }: About): string {
  const from = selection !== "" && !isWholePage && scope === "selection" ? "from your selection" : "from the page";
  return [...(answered ? [from] : []), engine, `${ms < 10 ? ms.toFixed(1) : Math.round(ms)} ms`].join(" · ");
}
