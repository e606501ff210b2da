/** The panels, in the order in which the page lists them. */
import type { Panel } from "./panel";

export const PANELS: readonly Panel[] = [];
