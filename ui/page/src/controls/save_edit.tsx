/** Save into the launch file: shows the edit first, then writes it. */
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { FileEdit } from "../connection/answers";
import { errorText } from "../store/text";

interface SaveProps {
  readonly label: string;
  /** Asks for the edit; writes it unless the run is dry. */
  readonly ask: (isDryRun: boolean) => Promise<FileEdit>;
}

export function SaveEdit({ label, ask }: SaveProps) {
  const answer = useSignal<FileEdit | null>(null);
  const error = useSignal<string | null>(null);
  const attempt = async (isDryRun: boolean) => {
    error.value = null;
    try {
      answer.value = await ask(isDryRun);
    } catch (reason) {
      error.value = errorText(reason);
    }
  };
  const close = () => {
    answer.value = error.value = null;
  };
  return (
    <>
      <button type="button" class="button" onClick={() => void attempt(true)}>
        {label}
      </button>
      {(answer.value !== null || error.value !== null) && (
        <SaveDialog answer={answer.value} error={error.value} onSave={() => void attempt(false)} onClose={close} />
      )}
    </>
  );
}

interface DialogProps {
  readonly answer: FileEdit | null;
  readonly error: string | null;
  readonly onSave: () => void;
  readonly onClose: () => void;
}

function SaveDialog({ answer, error, onSave, onClose }: DialogProps) {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => dialog.current?.showModal(), []);
  const hasEdit = answer !== null && answer.edit !== "";
  return (
    <dialog ref={dialog} class="about save" aria-labelledby="save-title" onClose={onClose}>
      <h2 id="save-title">{titleOf(answer, hasEdit)}</h2>
      {answer !== null && <p class="mono">{answer.file}</p>}
      {error !== null && (
        <p class="bad" role="alert">
          {error}
        </p>
      )}
      {hasEdit && <Diff edit={answer.edit} />}
      <footer class="buttons">
        <button type="button" class="button" onClick={() => dialog.current?.close()}>
          {answer?.saved === true || !hasEdit ? "Close" : "Cancel"}
        </button>
        {hasEdit && !answer.saved && (
          <button type="button" class="button primary" onClick={onSave}>
            Save
          </button>
        )}
      </footer>
    </dialog>
  );
}

function titleOf(answer: FileEdit | null, hasEdit: boolean): string {
  if (answer === null) return "This cannot be saved";
  if (answer.saved) return "Saved";
  return hasEdit ? "Save this edit into the launch file?" : "The launch file says the same already";
}

const LINE_CLASSES: Readonly<Record<string, string>> = { "+": "added", "-": "removed", "@": "place" };

function Diff({ edit }: { readonly edit: string }) {
  return (
    <pre class="mono diff" tabIndex={0} aria-label="The edit">
      {edit.split("\n").map((line, index) => (
        // Lines have no identity but their place, and the edit does not change while it is shown.
        <span key={index} class={/^(\+\+\+|---)/.test(line) ? "place" : (LINE_CLASSES[line.charAt(0)] ?? "")}>
          {line}
          {"\n"}
        </span>
      ))}
    </pre>
  );
}
