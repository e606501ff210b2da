/** The form of one node's parameters: each is set when it is entered, and a refusal stands beside its field. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Parameter, ParameterValue } from "../../connection/answers";
import type { Session } from "../../store/session";
import { errorText } from "../../store/text";
import { faultOf, fieldOf, grouped } from "./field_model";
import { ParameterField } from "./parameter_field";
import "./parameters.css";

interface FormProps {
  readonly session: Session;
  readonly node: string;
  /** Whether a parameter is shown. */
  readonly matches?: (parameter: Parameter) => boolean;
}

export function ParameterForm({ session, node, matches = () => true }: FormProps) {
  const { rows, error, read } = useParameters(session, node);
  if (rows === null) return <p class={error === null ? "quiet" : "bad"}>{error ?? "Reading the parameters"}</p>;
  const shown = rows.filter(matches);
  if (shown.length === 0) return <p class="quiet">{rows.length === 0 ? "It has no parameters." : "None matches."}</p>;

  const set = async (name: string, value: ParameterValue): Promise<string | null> => {
    try {
      if (!session.answersQuestions.peek()) return await session.serverParameters.set(node, name, value);
      const { faults } = await session.questions.ask("set_parameters", { node, values: { [name]: value } });
      return faultOf(faults, name);
    } catch (error) {
      return errorText(error);
    } finally {
      await read();
    }
  };
  return (
    <div class="parameters">
      {grouped(shown).map(([group, members]) => (
        <fieldset key={group} class="parameter-group">
          {group !== "" && <legend>{group}</legend>}
          {members.map((parameter) => (
            <ParameterField
              key={parameter.name}
              field={fieldOf(parameter)}
              id={`${node}.${parameter.name}`}
              mayChange={session.maySteer.value && !parameter.read_only}
              onSet={(value) => set(parameter.name, value)}
            />
          ))}
        </fieldset>
      ))}
    </div>
  );
}

interface Read {
  readonly rows: readonly Parameter[] | null;
  readonly error: string | null;
  readonly read: () => Promise<void>;
}

/** Reads a node's parameters, and again whenever one of them is set from anywhere. */
function useParameters(session: Session, node: string): Read {
  const rows = useSignal<readonly Parameter[] | null>(null);
  const error = useSignal<string | null>(null);
  const isOpen = session.isOpen.value;
  const changes = session.parameterChanges.value.get(node) ?? 0;
  const read = async () => {
    try {
      rows.value = session.answersQuestions.peek()
        ? (await session.questions.ask("parameters", { node })).parameters
        : await session.serverParameters.read(node);
      error.value = null;
    } catch (reason) {
      error.value = errorText(reason);
    }
  };
  useEffect(() => {
    rows.value = null;
  }, [node, rows]);
  useEffect(() => {
    if (isOpen) void read();
    // A reading belongs to a node, a connection and the last change, not to the function that reads.
  }, [node, isOpen, changes]);
  return { rows: rows.value, error: error.value, read };
}
