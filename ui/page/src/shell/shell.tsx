/** Shell: the page around the panels: the names of the views, the state of the run, and what must be said of it. */
import { useSignal, type Signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { PANELS, offeredPanels } from "../panels/registry";
import type { Session } from "../store/session";
import { About } from "./about";
import { Banners } from "./banners";
import { Icon } from "../controls/icons";
import { fragmentOf, readFragment, readLayout, withPlot, type Layout } from "./layout";
import { PLOT_EVENT, type PlotRequest } from "../plots/dragging";
import { TimeBar } from "../panels/time/time_bar";
import { TopBar } from "./top_bar";
import { Workspace } from "./workspace";

const KINDS = PANELS.map((panel) => panel.kind);

export function Shell({ session }: { readonly session: Session }) {
  const layout = useSignal(readFragment(location.hash, KINDS));
  const isAboutOpen = useSignal(false);
  useLayoutInAddress(layout);
  useLayoutOfFile(session, layout);
  usePlotting(layout);
  return (
    <div class="shell">
      <a class="skip" href="#main">
        Skip to the panels
      </a>
      <TopBar session={session} layout={layout} onAbout={() => (isAboutOpen.value = true)} />
      <nav class="rail" aria-label="Views">
        {offeredPanels(session).map(({ kind, title }) => (
          <button
            key={kind}
            type="button"
            class="rail-item"
            title={title}
            aria-current={layout.value.view === kind ? "page" : undefined}
            onClick={() => (layout.value = { ...layout.value, view: kind })}
          >
            <Icon name={kind} />
            <span>{title}</span>
          </button>
        ))}
      </nav>
      <main id="main" class="main" tabIndex={-1}>
        <Banners session={session} />
        <Workspace session={session} layout={layout} />
      </main>
      <TimeBar session={session} />
      {isAboutOpen.value && <About session={session} onClose={() => (isAboutOpen.value = false)} />}
    </div>
  );
}

/** Writes each change of the layout into the address, and reads an address that the person changes. */
function useLayoutInAddress(layout: Signal<Layout>): void {
  const fragment = fragmentOf(layout.value, KINDS[0] ?? "");
  useEffect(() => {
    if (location.hash === fragment) return;
    history.replaceState(null, "", location.pathname + location.search + fragment);
  }, [fragment]);
  useEffect(() => {
    const read = () => (layout.value = readFragment(location.hash, KINDS));
    addEventListener("hashchange", read);
    return () => removeEventListener("hashchange", read);
  }, [layout]);
}

/** Begins with the layout of the launch file, where the address holds none and nothing was touched yet. */
function useLayoutOfFile(session: Session, layout: Signal<Layout>): void {
  useEffect(() => {
    const untouched = layout.peek();
    if (location.hash.includes("layout=")) return undefined;
    let isAsked = false;
    return session.isOpen.subscribe((isOpen) => {
      if (!isOpen || isAsked || session.source.peek() !== "run") return;
      isAsked = true;
      queueMicrotask(() => {
        void session.questions.ask("layout", {}).then(
          (answer) => {
            if (answer.layout !== null && layout.peek() === untouched) layout.value = readLayout(answer.layout, KINDS);
          },
          () => undefined, // the launch file is gone or on another machine: the page begins as without one
        );
      });
    });
  }, [session, layout]);
}

/** Plots a number that the person chooses in a message. */
function usePlotting(layout: Signal<Layout>): void {
  useEffect(() => {
    const plot = (event: Event) => (layout.value = withPlot(layout.value, (event as CustomEvent<PlotRequest>).detail.address));
    addEventListener(PLOT_EVENT, plot);
    return () => removeEventListener(PLOT_EVENT, plot);
  }, [layout]);
}
