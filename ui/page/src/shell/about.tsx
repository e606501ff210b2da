/** About: what this page is, and the licence of every package that it is made with. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Session } from "../store/session";

interface Licence {
  readonly name: string;
  readonly version: string;
  readonly licence: string;
  readonly text: string;
}

interface AboutProps {
  readonly session: Session;
  readonly onClose: () => void;
}

export function About({ session, onClose }: AboutProps) {
  const dialog = useRef<HTMLDialogElement>(null);
  const licences = useSignal<readonly Licence[] | null>(null);
  useEffect(() => {
    dialog.current?.showModal();
    void loadLicences().then((found) => (licences.value = found));
  }, [licences]);
  const version = session.server.value?.metadata?.busflow;
  return (
    <dialog ref={dialog} class="about" aria-labelledby="about-title" onClose={onClose}>
      <header>
        <h2 id="about-title">busflow {version}</h2>
        <button type="button" class="button" onClick={() => dialog.current?.close()}>
          Close
        </button>
      </header>
      <p>A page beside a running graph. It asks nothing of any other server. Licence: Apache-2.0.</p>
      <h3>Made with</h3>
      {licences.value === null && <p class="quiet">The licences cannot be read.</p>}
      <ul>
        {licences.value?.map(({ name, version: of, licence, text }) => (
          <li key={name}>
            <details>
              <summary>
                {name} {of} <span class="quiet">{licence}</span>
              </summary>
              <pre class="mono" tabIndex={0}>
                {text}
              </pre>
            </details>
          </li>
        ))}
      </ul>
    </dialog>
  );
}

async function loadLicences(): Promise<readonly Licence[] | null> {
  try {
    const response = await fetch("licences.json");
    return response.ok ? ((await response.json()) as readonly Licence[]) : null;
  } catch {
    return null;
  }
}
