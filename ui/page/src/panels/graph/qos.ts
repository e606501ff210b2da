/** QoS of both ends of an edge as rows, and where they do not fit. Pure. */
import type { Qos } from "../../connection/answers";
import { secondsText } from "../../store/text";

export interface QosRow {
  readonly name: string;
  readonly offered: string;
  readonly requested: string;
  /** Whether what is offered is less than what is requested. */
  readonly fits: boolean;
}

const DURABILITIES = ["volatile", "transient_local"];
const LIVELINESS = ["automatic", "manual_by_topic"];

/** Returns the rows of a publisher's and a subscription's QoS; those that both leave out are left out. */
export function qosRows(offered: Qos, requested: Qos): readonly QosRow[] {
  const rows: readonly (QosRow | null)[] = [
    row("reliability", offered.reliability, requested.reliability, {
      fits: requested.reliability !== "reliable" || offered.reliability === "reliable",
    }),
    row("durability", offered.durability, requested.durability, {
      fits: rank(DURABILITIES, offered.durability) >= rank(DURABILITIES, requested.durability),
    }),
    row("depth", textOf(offered.depth), textOf(requested.depth), { fits: true }),
    row("overflow", "", requested.overflow ?? "", { fits: true }),
    row("deadline", periodText(offered.deadline_s), periodText(requested.deadline_s), {
      fits: isWithin(offered.deadline_s, requested.deadline_s),
    }),
    row("lifespan", periodText(offered.lifespan_s), periodText(requested.lifespan_s), { fits: true }),
    row("liveliness", words(offered.liveliness), words(requested.liveliness), {
      fits: rank(LIVELINESS, offered.liveliness ?? "automatic") >= rank(LIVELINESS, requested.liveliness ?? "automatic"),
    }),
    row("lease", periodText(offered.lease_s), periodText(requested.lease_s), {
      fits: isWithin(offered.lease_s, requested.lease_s),
    }),
  ];
  return rows.filter((each) => each !== null);
}

function row(name: string, offered: string, requested: string, { fits }: { fits: boolean }): QosRow | null {
  if (offered === "" && requested === "") return null;
  return { name, offered: words(offered) || "–", requested: words(requested) || "–", fits };
}

const rank = (order: readonly string[], word: string): number => order.indexOf(word);
const words = (word: string | null | undefined): string => (word ?? "").replaceAll("_", " ");
const textOf = (depth: number | null | undefined): string => (depth ?? null) === null ? "" : String(depth);

function periodText(seconds: number | null | undefined): string {
  return (seconds ?? null) === null ? "" : secondsText(Number(seconds));
}

/** Whether an offered period is at most the requested one; none is requested by null. */
function isWithin(offered: number | null | undefined, requested: number | null | undefined): boolean {
  if ((requested ?? null) === null) return true;
  return (offered ?? null) !== null && Number(offered) <= Number(requested);
}
