/** Limits: how long the page waits in real time, in milliseconds. */

const stated = {
  /** Answer of a run to a question, or of a server to a request for parameters. */
  answer: 10_000,
  /** Overview of a large recording, which is read for seconds. */
  overview: 60_000,
  /** Answer of the assistant; the server gives up by itself before. */
  assistant: 65_000,
  /** Sight of the word that code was copied. */
  copied: 1_500,
};

declare global {
  /** Other limits of a test, which are there before the page starts. */
  var busflowLimits: Partial<typeof stated> | undefined;
}

export const limits: Readonly<typeof stated> = { ...stated, ...globalThis.busflowLimits };
