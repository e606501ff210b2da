/** The call of one service: its form, its time limit, and the answer or the reason why there is none. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useMemo } from "preact/hooks";
import type { OfferedService } from "../../connection/protocol";
import { decoderOf, type Decoder } from "../../messages/decoding";
import { encoderOf, type Encoder } from "../../messages/encoding";
import type { Session } from "../../store/session";
import { secondsText } from "../../store/text";
import { RequestInput } from "./request_input";
import { requestFields, requestOf, type RequestField } from "./request_model";
import { answerLines } from "./answer_text";

interface CallProps {
  readonly session: Session;
  readonly service: OfferedService;
}

type Outcome =
  | { readonly kind: "waiting" }
  | { readonly kind: "answer"; readonly message: unknown; readonly tookMs: number }
  | { readonly kind: "failure"; readonly reason: string };

const USUAL_LIMIT_S = 5;
const LEAST_LIMIT_S = 0.1;
/** The server gives up by itself after this time. */
const MOST_LIMIT_S = 30;
const NO_ERRORS: ReadonlyMap<string, string> = new Map();

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
      outcome.value = { kind: "failure", reason: (error as Error).message };
    }
  };
  const isWaiting = outcome.value?.kind === "waiting";
  return (
    <div class="call">
      <h3 class="mono">{service.name}</h3>
      <p class="quiet small mono">{service.type}</p>
      <RequestForm fields={requestFields(codec.request.shape)} onRequest={(message) => void call(message)}>
        <button type="submit" class="button primary" disabled={isWaiting || !session.maySteer.value}>
          {isWaiting ? "Calling…" : "Call"}
        </button>
        <TimeLimit seconds={limit.value} onSeconds={(seconds) => (limit.value = seconds)} />
      </RequestForm>
      <OutcomeView outcome={outcome.value} />
    </div>
  );
}

interface FormProps {
  readonly fields: readonly RequestField[];
  readonly onRequest: (message: unknown) => void;
  /** The controls below the fields. */
  readonly children: ComponentChildren;
}

function RequestForm({ fields, onRequest, children }: FormProps) {
  const texts = useSignal<ReadonlyMap<string, string>>(new Map());
  const errors = useSignal(NO_ERRORS);
  const onSubmit = (event: Event) => {
    event.preventDefault();
    const built = requestOf(fields, texts.value);
    errors.value = "errors" in built ? built.errors : NO_ERRORS;
    if ("message" in built) onRequest(built.message);
  };
  return (
    <form class="call-fields" onSubmit={onSubmit}>
      {fields.length === 0 && <p class="quiet">Its request has no fields.</p>}
      {fields.map((field) => {
        const key = field.path.join(".");
        return (
          <RequestInput
            key={key}
            field={field}
            text={texts.value.get(key) ?? ""}
            error={errors.value.get(key) ?? null}
            onText={(text) => (texts.value = new Map([...texts.value, [key, text]]))}
          />
        );
      })}
      <div class="buttons">{children}</div>
    </form>
  );
}

interface LimitProps {
  readonly seconds: number;
  readonly onSeconds: (seconds: number) => void;
}

function TimeLimit({ seconds, onSeconds }: LimitProps) {
  return (
    <label class="check quiet">
      time limit
      <input
        class="field limit"
        type="number"
        min={LEAST_LIMIT_S}
        max={MOST_LIMIT_S}
        step="any"
        value={seconds}
        onChange={(event) => {
          const typed = event.currentTarget.valueAsNumber || USUAL_LIMIT_S;
          onSeconds(Math.min(MOST_LIMIT_S, Math.max(LEAST_LIMIT_S, typed)));
        }}
      />
      s
    </label>
  );
}

function OutcomeView({ outcome }: { readonly outcome: Outcome | null }) {
  return (
    <div role="status" class="outcome">
      {outcome?.kind === "failure" && <p class="bad">{outcome.reason}</p>}
      {outcome?.kind === "answer" && (
        <>
          <p class="quiet small">Answered in {secondsText(outcome.tookMs / 1000)}</p>
          <pre class="mono answer" tabIndex={0}>
            {answerLines(outcome.message).join("\n") || "(an answer without fields)"}
          </pre>
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
    return (error as Error).message;
  }
}
