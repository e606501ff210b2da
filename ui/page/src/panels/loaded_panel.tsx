/** Loaded panel: one whose code the browser loads when it is first shown, so that the others are there sooner. */
import { signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import type { PanelProps } from "./panel";

type Body = ComponentType<PanelProps>;

export function loadedPanel(load: () => Promise<Body>): Body {
  const loaded = signal<Body | null>(null);
  return (props) => {
    const [error, setError] = useState<Error | null>(null);
    useEffect(() => {
      if (loaded.peek() === null) load().then((body) => (loaded.value = body), setError);
    }, []);
    if (error !== null) throw error; // which is said in place of the panel
    const Body = loaded.value;
    return Body === null ? <div class="empty" aria-busy="true" /> : <Body {...props} />;
  };
}
