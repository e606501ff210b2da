/** The width of text as the browser draws it, in the fonts of graph.css. */
import type { Measure } from "./layout";

const context = document.createElement("canvas").getContext("2d");
const style = getComputedStyle(document.documentElement);
const fontOf = (variable: string): string => style.getPropertyValue(variable) || "sans-serif";

export const measureText: Measure = (label, kind) => {
  if (context === null) return label.length * 8;
  context.font = kind === "node" || kind === "group" ? `600 13px ${fontOf("--sans")}` : `12px ${fontOf("--mono")}`;
  return context.measureText(label).width;
};
