/** Record button: begins and ends a recording of the run, and says where it is. */

import { useEffect, useRef, useState } from "preact/hooks";
import type { Recorded } from "../../connection/answers";
import type { Session } from "../../store/session";
import { counted, errorText } from "../../store/text";

export function RecordButton({ session }: { readonly session: Session }) {
  const [recorded, setRecorded] = useState<Recorded>({ on: false });
  const [fault, setFault] = useState("");
  const [isBusy, setBusy] = useState(false);
  useEffect(() => session.questions.follow("record", setRecorded), [session]);
  const toggle = async (): Promise<void> => {
    setBusy(true);
    try {
      setRecorded(await session.questions.ask("record", { on: !recorded.on }));
      setFault("");
    } catch (error) {
      setFault(errorText(error));
    } finally {
      setBusy(false);
    }
  };
  const { on, messages } = recorded;
  const lastPath = useRef<string>(undefined);
  lastPath.current = recorded.path ?? lastPath.current; // after the end it says where the recording is
  const path = lastPath.current;
  return (
    <>
      {session.maySteer.value && (
        <button type="button" class="button" aria-pressed={on} disabled={isBusy} onClick={() => void toggle()}>
          <span class={on ? "record-dot on" : "record-dot"} aria-hidden="true" />
          {on ? "Stop recording" : "Record"}
        </button>
      )}
      <span class="small quiet record-text" role="status" title={path}>
        {path === undefined ? "" : `${messages == null ? "" : `${counted(messages, "message")} in `}${path}`}
      </span>
      {fault !== "" && (
        <span class="small bad" role="alert">
          {fault}
        </span>
      )}
    </>
  );
}
