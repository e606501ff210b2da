/** Hooks of the panels that show what is received. */

import { useEffect, useRef, useState } from "preact/hooks";
import { PathError } from "../messages/paths";
import type { Line } from "./lines";
import type { Observation } from "./observation";

const LEAST_MS = 100; // between two changes of text, which nobody reads faster

/** Line of a plot, or why there is none. */
export type Opened = { readonly text: string; readonly line: Line } | { readonly text: string; readonly fault: string };

/** Opens the lines of addresses for as long as the component stands. */
export function useOpened(observation: Observation, texts: readonly string[]): readonly Opened[] {
  const [opened, setOpened] = useState<readonly Opened[]>([]);
  const before = useRef<readonly Opened[]>([]);
  const key = texts.join("\n");
  useEffect(() => {
    const found = key === "" ? [] : key.split("\n").map((text) => open(observation, text));
    close(observation, before.current); // after the opening: a line that stays keeps its points
    before.current = found;
    setOpened(found);
  }, [observation, key]);
  useEffect(
    () => () => {
      close(observation, before.current);
      before.current = [];
    },
    [observation],
  );
  return opened;
}

function close(observation: Observation, opened: readonly Opened[]): void {
  for (const each of opened) if ("line" in each) observation.lines.close(each.line);
}

function open(observation: Observation, text: string): Opened {
  try {
    return { text, line: observation.lines.open(text) };
  } catch (error) {
    if (error instanceof PathError) return { text, fault: error.message };
    throw error;
  }
}

/** Renders the component again after frames, at most ten times in a second. */
export function useFrames(observation: Observation, isOn = true): void {
  const [, setCount] = useState(0);
  useEffect(() => {
    if (!isOn) return undefined;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const end = observation.frames.listen(() => {
      timer ??= setTimeout(() => {
        timer = undefined;
        setCount((count) => count + 1);
      }, LEAST_MS);
    });
    return () => {
      end();
      clearTimeout(timer);
    };
  }, [observation, isOn]);
}

/** Follows topics while the component stands, and draws a frame with each message. */
export function useFollowed(observation: Observation, topics: readonly string[]): void {
  const key = topics.join("\n");
  useEffect(() => {
    const ends = (key === "" ? [] : key.split("\n")).map((topic) => observation.receiver.follow(topic, () => observation.frames.request()));
    return () => {
      for (const end of ends) end();
    };
  }, [observation, key]);
}

/** Calls back when the theme of the page or of the system changes. */
export function useThemeChange(changed: () => void): void {
  useEffect(() => {
    const system = matchMedia("(prefers-color-scheme: dark)");
    const page = new MutationObserver(changed);
    page.observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme"] });
    system.addEventListener("change", changed);
    return () => {
      page.disconnect();
      system.removeEventListener("change", changed);
    };
  }, [changed]);
}
