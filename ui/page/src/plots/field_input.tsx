/** Field input: a line's address, typed, with the fields that are offered. */

import { useState } from "preact/hooks";
import type { TargetedKeyboardEvent } from "preact";
import { addressText, NAMES, parseAddress } from "../messages/paths";
import { numbersOfMessage, numbersOfShape } from "../messages/shapes";
import type { Receiver } from "../messages/receiver";
import type { Session } from "../store/session";
import { errorText } from "../store/text";
import { completions } from "./completion";
import { useFollowed, useFrames } from "./hooks";
import { observationOf, type Observation } from "./observation";

const MOST_OFFERED = 40;
let ids = 0;

interface Props {
  readonly session: Session;
  readonly onField: (address: string) => void;
}

export function FieldInput({ session, onField }: Props) {
  const [id] = useState(() => `fields-${(ids += 1)}`);
  const [typed, setTyped] = useState("");
  const [isOpen, setOpen] = useState(false);
  const [active, setActive] = useState(-1);
  const [fault, setFault] = useState<string>();
  const observation = observationOf(session);
  const topics = [...session.topics.channels.value.keys()];
  const offered = isOpen ? completions(typed, candidatesOf(observation.receiver, topics), MOST_OFFERED) : [];
  useNames(observation, topics, isOpen);
  const edit = (text: string, open: boolean): void => {
    setTyped(text);
    setOpen(open);
    setActive(-1);
    setFault(undefined);
  };
  const take = (text: string): void => {
    const found = addressOf(text);
    setFault(found.fault);
    if (found.address === undefined) return;
    onField(found.address);
    edit("", false);
  };
  const keys: Readonly<Record<string, () => void>> = {
    ArrowDown: () => setActive(Math.min(offered.length - 1, active + 1)),
    ArrowUp: () => setActive(Math.max(-1, active - 1)),
    Enter: () => take(offered[active] ?? (offered.length === 1 ? (offered[0] ?? typed) : typed)),
    Escape: () => setOpen(false),
  };
  return (
    <div class="field-input">
      <input
        class="field"
        type="text"
        role="combobox"
        aria-label="Add a line"
        aria-expanded={offered.length > 0}
        aria-controls={id}
        aria-autocomplete="list"
        aria-activedescendant={active >= 0 ? `${id}-${active}` : undefined}
        aria-invalid={fault !== undefined}
        placeholder="Add a line: imu/data.linear_acceleration.y"
        autocomplete="off"
        spellcheck={false}
        value={typed}
        onInput={(event) => edit(event.currentTarget.value, true)}
        onFocus={() => setOpen(true)}
        onBlur={() => setOpen(false)}
        onKeyDown={(event) => onKey(event, keys)}
      />
      <Offered id={id} fields={offered} active={active} onTake={take} />
      {fault !== undefined && (
        <p class="field-fault bad small" role="alert">
          {fault}
        </p>
      )}
    </div>
  );
}

function onKey(event: TargetedKeyboardEvent<HTMLInputElement>, keys: Readonly<Record<string, () => void>>): void {
  const action = keys[event.key];
  if (action === undefined) return;
  event.preventDefault();
  action();
}

interface OfferedProps {
  readonly id: string;
  readonly fields: readonly string[];
  readonly active: number;
  readonly onTake: (address: string) => void;
}

function Offered({ id, fields, active, onTake }: OfferedProps) {
  return (
    <ul id={id} class="offered" role="listbox" aria-label="Fields" hidden={fields.length === 0}>
      {fields.map((each, at) => (
        <li
          key={each}
          id={`${id}-${at}`}
          role="option"
          aria-selected={at === active}
          ref={(row) => {
            if (at === active) row?.scrollIntoView({ block: "nearest" });
          }}
          onPointerDown={(event) => {
            event.preventDefault(); // the input keeps the focus
            onTake(each);
          }}
        >
          {each}
        </li>
      ))}
    </ul>
  );
}

/** Follows the topics whose items have names, which only a message gives, while fields are offered. */
function useNames(observation: Observation, topics: readonly string[], isOn: boolean): void {
  const named = topics.filter((topic) => {
    const fields = observation.receiver.shapeOf(topic)?.fields;
    return NAMES.some((each) => fields?.get(each)?.many);
  });
  useFollowed(observation, isOn ? named : []);
  useFrames(observation, isOn);
}

function candidatesOf(receiver: Receiver, topics: readonly string[]): string[] {
  return topics.flatMap((topic) => {
    const reading = receiver.shown(topic)?.reading;
    const shape = receiver.shapeOf(topic);
    const paths = reading !== undefined && reading.fault === undefined ? numbersOfMessage(reading.message) : shape ? numbersOfShape(shape) : [];
    return paths.map((path) => addressText({ topic, path }));
  });
}

function addressOf(text: string): { readonly address?: string; readonly fault?: string } {
  try {
    return { address: addressText(parseAddress(text)) };
  } catch (error) {
    return { fault: errorText(error) };
  }
}
