/** One field of a request's form. */
import { jsonText } from "../messages/json";
import type { RequestField } from "./request_model";

interface InputProps {
  readonly field: RequestField;
  readonly text: string;
  readonly error: string | null;
  readonly onText: (text: string) => void;
}

const EXAMPLES: Readonly<Record<RequestField["kind"], string>> = {
  switch: "",
  integer: "0",
  number: "0.0",
  text: "",
  json: "[]",
};

/** Returns what stands for an empty field: the default of its type. */
function usualText({ usual }: RequestField): string {
  return usual === undefined ? "" : typeof usual === "string" ? usual : jsonText(usual);
}

export function RequestInput({ field, text, error, onText }: InputProps) {
  const id = `request-${field.path.join(".")}`;
  return (
    <div class="request-field">
      <label htmlFor={id}>{field.path.join(".")}</label>
      {field.kind === "switch" ? (
        <input
          id={id}
          type="checkbox"
          role="switch"
          checked={(text || usualText(field)) === "true"}
          onChange={(event) => onText(String(event.currentTarget.checked))}
        />
      ) : (
        <input
          id={id}
          class={`field ${field.kind === "json" ? "mono" : ""}`}
          inputMode={field.kind === "integer" || field.kind === "number" ? "decimal" : "text"}
          placeholder={usualText(field) || EXAMPLES[field.kind]}
          aria-invalid={error !== null}
          aria-describedby={error === null ? undefined : `${id}-error`}
          spellcheck={false}
          autocomplete="off"
          value={text}
          onInput={(event) => onText(event.currentTarget.value)}
        />
      )}
      <span class="quiet small mono">{field.type}</span>
      {error !== null && (
        <span id={`${id}-error`} class="bad small" role="alert">
          {error}
        </span>
      )}
    </div>
  );
}
