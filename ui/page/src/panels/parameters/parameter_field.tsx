/** One parameter: its control, its unit and description, what the file says, and why a value was refused. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { ParameterValue } from "../../connection/answers";
import { leafText } from "../../messages/rows";
import { differenceOf, readText, textOf, type Field } from "./field_model";

interface ParameterFieldProps {
  readonly field: Field;
  readonly id: string;
  readonly mayChange: boolean;
  /** Sets the value; resolves to the reason of a refusal, or to null. */
  readonly onSet: (value: ParameterValue) => Promise<string | null>;
}

export function ParameterField({ field, id, mayChange, onSet }: ParameterFieldProps) {
  const { parameter } = field;
  const current = textOf(parameter.value, field);
  const typed = useSignal(current);
  const latest = useRef(current); // also for what began with an earlier value
  latest.current = current;
  const reason = useSignal<string | null>(null);
  useEffect(() => {
    typed.value = current;
  }, [current, typed]);

  const enter = async (text: string) => {
    if (text === current) return;
    const read = readText(text, field);
    reason.value = "error" in read ? read.error : await onSet(read.value);
    // What was refused does not stay in the field as if it were so: the reason beside it names it.
    if (reason.value !== null) typed.value = latest.current;
  };
  const described = [`${id}-about`, reason.value === null ? "" : `${id}-reason`].filter(Boolean).join(" ");
  const difference = differenceOf(parameter);
  return (
    <div class={`parameter ${difference === null ? "" : "differs"}`}>
      <label class="parameter-name" htmlFor={id}>
        <span>{parameter.name.slice(parameter.name.lastIndexOf(".") + 1)}</span>
      </label>
      <div class="parameter-control">
        {mayChange ? (
          <Control
            field={field}
            id={id}
            described={described}
            text={typed.value}
            isInvalid={reason.value !== null}
            onType={(text) => (typed.value = text)}
            onEnter={(text) => void enter(text)}
          />
        ) : (
          <output id={id} class="parameter-value">
            {leafText(current)}
          </output>
        )}
        <span class="quiet parameter-unit">{field.unit}</span>
      </div>
      {reason.value !== null && (
        <p id={`${id}-reason`} class="bad parameter-reason" role="alert">
          {reason.value}
        </p>
      )}
      <p id={`${id}-about`} class="quiet small parameter-about">
        {field.description} {rangeText(field)} {parameter.read_only && "Read-only while it runs."}
        {difference !== null && <span class="parameter-difference">{difference}</span>}
      </p>
    </div>
  );
}

/** The bounds in words, where no slider shows them. */
function rangeText({ kind, parameter }: Field): string {
  const range = parameter.range ?? "";
  return kind === "slider" || range === "" ? "" : `${range.charAt(0).toUpperCase()}${range.slice(1)}.`;
}

interface ControlProps {
  readonly field: Field;
  readonly id: string;
  readonly described: string;
  readonly text: string;
  readonly isInvalid: boolean;
  readonly onType: (text: string) => void;
  readonly onEnter: (text: string) => void;
}

function Control(props: ControlProps) {
  const { field, id, described, text, onType, onEnter } = props;
  switch (field.kind) {
    case "switch":
      return (
        <input
          id={id}
          type="checkbox"
          role="switch"
          aria-describedby={described}
          checked={text === "true"}
          onChange={(event) => onEnter(String(event.currentTarget.checked))}
        />
      );
    case "choice":
      return (
        <select
          id={id}
          aria-describedby={described}
          value={text}
          onChange={(event) => onEnter(event.currentTarget.value)}
        >
          {field.parameter.choices?.map((choice) => {
            const word = textOf(choice, field);
            return (
              <option key={word} value={word}>
                {word}
              </option>
            );
          })}
        </select>
      );
    case "slider":
      return (
        <>
          <input
            type="range"
            aria-label={`${field.parameter.name}, slider`}
            min={field.minimum}
            max={field.maximum}
            step={field.step}
            value={text}
            onInput={(event) => onType(sliderText(event.currentTarget.value, field))}
            onChange={(event) => onEnter(sliderText(event.currentTarget.value, field))}
          />
          <TextControl {...props} />
        </>
      );
    default:
      return <TextControl {...props} />;
  }
}

/** A field of text: Enter or leaving it sets the value, Escape brings the old one back. */
function TextControl({ field, id, described, text, isInvalid, onType, onEnter }: ControlProps) {
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key === "Enter") onEnter(text);
    if (event.key === "Escape") onType(textOf(field.parameter.value, field));
  };
  return (
    <input
      id={id}
      class={`field ${field.kind}`}
      inputMode={field.kind === "number" || field.kind === "slider" ? "decimal" : "text"}
      aria-describedby={described}
      aria-invalid={isInvalid}
      spellcheck={false}
      autocomplete="off"
      value={text}
      onInput={(event) => onType(event.currentTarget.value)}
      onKeyDown={onKeyDown}
      onBlur={() => onEnter(text)}
    />
  );
}

function sliderText(text: string, field: Field): string {
  return textOf(Number(text), field);
}
