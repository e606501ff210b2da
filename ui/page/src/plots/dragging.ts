/** Dragging of a field from a message into a plot, and the same by a key or a click. */

import { addressText, parsePath } from "../messages/paths";

const TYPE = "application/x-busflow-field";
/** Event that asks the page to plot a field; its detail is a `PlotRequest`. */
export const PLOT_EVENT = "busflow-plot";

export interface Field {
  readonly topic: string;
  readonly field: string;
}

/** What `PLOT_EVENT` asks for. */
export interface PlotRequest extends Field {
  readonly address: string;
}

/** Puts a field into what is dragged. */
export function drag(transfer: DataTransfer, field: Field): void {
  transfer.setData(TYPE, JSON.stringify(field));
  transfer.setData("text/plain", addressOf(field));
  transfer.effectAllowed = "copy";
}

/** Whether what is dragged is a field. */
export function isField(transfer: DataTransfer | null): transfer is DataTransfer {
  return transfer?.types.includes(TYPE) ?? false;
}

/** Returns the address of a dragged field; undefined if it is none. */
export function dropped(transfer: DataTransfer): string | undefined {
  try {
    const { topic, field } = JSON.parse(transfer.getData(TYPE)) as Partial<Field>;
    return typeof topic === "string" && typeof field === "string" ? addressOf({ topic, field }) : undefined;
  } catch {
    return undefined; // another page's data under the same name
  }
}

/** Asks the page to plot a field. */
export function plot(from: EventTarget, field: Field): void {
  const detail: PlotRequest = { ...field, address: addressOf(field) };
  from.dispatchEvent(new CustomEvent(PLOT_EVENT, { detail, bubbles: true, composed: true }));
}

function addressOf({ topic, field }: Field): string {
  return addressText({ topic, path: parsePath(field) });
}
