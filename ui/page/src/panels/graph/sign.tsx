/** Sign: the state of a node as a shape, so that it is read without its colour. */
import type { Tone } from "./model";

const SHAPES: Readonly<Record<Tone, string>> = {
  good: "M4 .5a3.5 3.5 0 1 0 0 7 3.5 3.5 0 0 0 0-7z",
  waiting: "M4 1.2a2.8 2.8 0 1 0 0 5.6 2.8 2.8 0 0 0 0-5.6z",
  stopped: "M1 1h6v6H1z",
  bad: "M1.2 1.2l5.6 5.6M6.8 1.2 1.2 6.8",
  none: "",
};

export function SignPath({ tone }: { readonly tone: Tone }) {
  return <path class={`sign ${tone}`} d={SHAPES[tone]} />;
}

export function Sign({ tone }: { readonly tone: Tone }) {
  return (
    <svg viewBox="0 0 8 8" width="9" height="9" aria-hidden="true">
      <SignPath tone={tone} />
    </svg>
  );
}
