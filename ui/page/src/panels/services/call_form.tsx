/** The call of one service: its form, its time limit, and the answer or the reason why there is none. */
import { useSignal } from "@preact/signals";
import { useMemo } from "preact/hooks";
import type { OfferedService } from "../../connection/protocol";
import { Answer } from "../../forms/answer";
import { RequestForm } from "../../forms/request_form";
import { TimeLimit } from "../../forms/time_limit";
import { decoderOf, type Decoder } from "../../messages/decoding";
import { encoderOf, type Encoder } from "../../messages/encoding";
import type { Session } from "../../store/session";
import { errorText, secondsText } from "../../store/text";

interface CallProps {
  readonly session: Session;
  readonly service: OfferedService;
}

type Outcome =
  | { readonly kind: "waiting" }
  | { readonly kind: "answer"; readonly message: unknown; readonly tookMs: number }
  | { readonly kind: "failure"; readonly reason: string };

const USUAL_LIMIT_S = 5;
/** The server gives up by itself after this time. */
const MOST_LIMIT_S = 30;

export function CallForm({ session, service }: CallProps) {
  const codec = useMemo(() => codecOf(service), [service]);
  const outcome = useSignal<Outcome | null>(null);
  const limit = useSignal(USUAL_LIMIT_S);
  if (typeof codec === "string") return <p class="bad">{codec}</p>;

  const call = async (message: unknown) => {
    const sinceMs = performance.now();
    outcome.value = { kind: "waiting" };
    try {
      const data = await session.services.call(service, codec.request.encode(message), limit.value * 1000);
      outcome.value = { kind: "answer", message: codec.response.decode(data), tookMs: performance.now() - sinceMs };
    } catch (error) {
      outcome.value = { kind: "failure", reason: errorText(error) };
    }
  };
  const isWaiting = outcome.value?.kind === "waiting";
  return (
    <div class="call">
      <h3 class="mono">{service.name}</h3>
      <p class="quiet small mono">{service.type}</p>
      <RequestForm shape={codec.request.shape} empty="Its request has no fields." onRequest={(message) => void call(message)}>
        <button type="submit" class="button primary" disabled={isWaiting || !session.maySteer.value}>
          {isWaiting ? "Calling…" : "Call"}
        </button>
        <TimeLimit
          seconds={limit.value}
          most={MOST_LIMIT_S}
          usual={USUAL_LIMIT_S}
          onSeconds={(seconds) => (limit.value = seconds ?? USUAL_LIMIT_S)}
        />
      </RequestForm>
      <OutcomeView outcome={outcome.value} />
    </div>
  );
}

function OutcomeView({ outcome }: { readonly outcome: Outcome | null }) {
  return (
    <div role="status" class="outcome">
      {outcome?.kind === "failure" && <p class="bad">{outcome.reason}</p>}
      {outcome?.kind === "answer" && (
        <>
          <p class="quiet small">Answered in {secondsText(outcome.tookMs / 1000)}</p>
          <Answer message={outcome.message} empty="(an answer without fields)" />
        </>
      )}
    </div>
  );
}

interface Codec {
  readonly request: Encoder;
  readonly response: Decoder;
}

/** Returns what encodes and decodes the service's messages, or a sentence why that cannot be. */
function codecOf({ name, request, response }: OfferedService): Codec | string {
  if (request === undefined || response === undefined) return `${name}: the server says nothing of its types.`;
  try {
    return { request: encoderOf(request), response: decoderOf({ id: 0, topic: `the answer of ${name}`, ...response }) };
  } catch (error) {
    return errorText(error);
  }
}
