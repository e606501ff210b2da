/** Live parts of a text: panels of the run, as long as there is one; until then each says how to start it. */
import { effect } from "@preact/signals";
import { theme } from "../shell/theme";
import type { Session } from "../store/session";

const HOSTS = ".live[data-live]";

/** Keeps the live parts of the page in step with the run; call `update` when another text is shown. */
export function showLiveParts(session: Session, token: string): { readonly update: () => void } {
  const update = (isOpen: boolean, topics: ReadonlyMap<string, unknown>): void => {
    const hosts = [...document.querySelectorAll<HTMLElement>(HOSTS)];
    for (const host of hosts) {
      const { topic } = host.dataset;
      // Another lab may run, which has no such topic.
      const isLive = isOpen && (topic === undefined || topics.has(topic.startsWith("/") ? topic : `/${topic}`));
      if (isLive !== (host.querySelector(".live-panel") !== null)) show(host, isLive, token);
    }
    // The panels, with the plots' library, are loaded by a page that shows one.
    if (isOpen && hosts.length > 0) void import("../components/index");
  };
  effect(() => {
    update(session.isOpen.value, session.topics.channels.value);
  });
  effect(() => {
    const now = theme.value;
    for (const panel of document.querySelectorAll<HTMLElement>(".live-panel")) setTheme(panel, now);
  });
  return { update: () => update(session.isOpen.peek(), session.topics.channels.peek()) };
}

function show(host: HTMLElement, isOpen: boolean, token: string): void {
  host.querySelector(".live-panel")?.remove();
  host.classList.toggle("is-live", isOpen);
  if (!isOpen) return;
  const { live, ...attributes } = host.dataset;
  const panel = document.createElement(`busflow-${live ?? "graph"}`);
  panel.className = "live-panel";
  for (const [name, value] of Object.entries(attributes)) panel.setAttribute(name, value ?? "");
  panel.setAttribute("token", token);
  setTheme(panel, theme.peek());
  host.append(panel);
}

function setTheme(panel: HTMLElement, now: string): void {
  if (now === "auto") panel.removeAttribute("data-theme");
  else panel.setAttribute("data-theme", now);
}
