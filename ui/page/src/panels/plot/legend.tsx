/** Legend of a plot: each line with its value now, at the pointer, and at the cursors with their difference. */

import { valueBefore } from "../../messages/ring";
import type { Channel } from "../../connection/protocol";
import { useFrames, type Opened } from "../../plots/hooks";
import type { Line } from "../../plots/lines";
import type { Observation } from "../../plots/observation";
import type { Session } from "../../store/session";
import { colourNumber } from "../../plots/palette";
import { numberText } from "../../plots/ticks";

interface Props {
  readonly session: Session;
  readonly observation: Observation;
  readonly opened: readonly Opened[];
  readonly hoverS: number | undefined;
  readonly onRemove: (text: string) => void;
}

export function Legend({ session, observation, opened, hoverS, onRemove }: Props) {
  useFrames(observation);
  const [a, b] = observation.timeline.cursors.value;
  if (opened.length === 0) return null;
  const moments = [hoverS ?? Infinity, ...(a === undefined ? [] : [a]), ...(b === undefined ? [] : [b])];
  const { channels } = session.topics;
  const hasDifference = a !== undefined && b !== undefined;
  return (
    <div class="legend" role="region" aria-label="Lines" tabIndex={0}>
      <table class="table">
        <thead>
          <tr>
            <th scope="col">
              Line <span class="legend-hint">{hintOf(a, b)}</span>
            </th>
            <th scope="col" class="number">
              {hoverS === undefined ? "Now" : "Pointer"}
            </th>
            {a !== undefined && <th scope="col" class="number">A</th>}
            {b !== undefined && <th scope="col" class="number">B</th>}
            {hasDifference && <th scope="col" class="number">B − A in {numberText(Number((b - a).toPrecision(6)))} s</th>}
            <th scope="col">
              <span class="visually-hidden">Remove</span>
            </th>
          </tr>
        </thead>
        <tbody>
          {opened.map((each, at) => (
            <tr key={each.text}>
              <th scope="row">
                <svg class={`swatch series-${colourNumber(at)}`} viewBox="0 0 20 4" width="20" height="4" aria-hidden="true">
                  <path d="M0 2h20" class={`dash-${Math.floor(at / 8) % 4}`} />
                </svg>{" "}
                <span class="mono">{"line" in each ? each.line.text : each.text}</span>
                {"line" in each && each.line.unit !== undefined && <span class="quiet"> {each.line.unit}</span>}
                <Fault text={faultOf(each, channels.value)} />
              </th>
              {moments.map((time, column) => (
                <td key={column} class="number mono">
                  {"line" in each ? textAt(each.line, time) : "–"}
                </td>
              ))}
              {hasDifference && <td class="number mono">{"line" in each ? differenceText(each.line, a, b) : "–"}</td>}
              <td class="number">
                <button type="button" class="button plain icon" aria-label={`Remove ${each.text}`} onClick={() => onRemove(each.text)}>
                  ×
                </button>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Fault({ text }: { readonly text: string | undefined }) {
  return text === undefined ? null : <span class="bad"> {text}</span>;
}

function faultOf(each: Opened, channels: ReadonlyMap<string, Channel>): string | undefined {
  if (!("line" in each)) return each.fault;
  const { topic } = each.line.address;
  return channels.has(topic) ? each.line.fault : `there is no topic ${topic} now`;
}

/** What to do for the next cursor. */
function hintOf(a: number | undefined, b: number | undefined): string {
  if (a === undefined) return "click: cursor A";
  return b === undefined ? "Shift and click: cursor B" : "double click: no cursors";
}

function textAt(line: Line, timeS: number): string {
  const value = valueBefore(line.points, timeS);
  return value === undefined ? "–" : numberText(value);
}

function differenceText(line: Line, a: number, b: number): string {
  const [first, second] = [valueBefore(line.points, a), valueBefore(line.points, b)];
  return first === undefined || second === undefined ? "–" : numberText(Number((second - first).toPrecision(6)));
}
