/** Request form: a field for each leaf of a message type, and the message that they make. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import type { Shape } from "../messages/shapes";
import { RequestInput } from "./request_input";
import { requestFields, requestOf } from "./request_model";
import "./forms.css";

const NO_ERRORS: ReadonlyMap<string, string> = new Map();

interface FormProps {
  readonly shape: Shape;
  /** What is said where the type has no fields. */
  readonly empty: string;
  readonly onRequest: (message: unknown) => void;
  /** The controls below the fields. */
  readonly children: ComponentChildren;
}

export function RequestForm({ shape, empty, onRequest, children }: FormProps) {
  const texts = useSignal<ReadonlyMap<string, string>>(new Map());
  const errors = useSignal(NO_ERRORS);
  const fields = requestFields(shape);
  const onSubmit = (event: Event) => {
    event.preventDefault();
    const built = requestOf(fields, texts.value);
    errors.value = "errors" in built ? built.errors : NO_ERRORS;
    if ("message" in built) onRequest(built.message);
  };
  return (
    <form class="call-fields" onSubmit={onSubmit}>
      {fields.length === 0 && <p class="quiet">{empty}</p>}
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
