/** Answer: a message as lines of text. */
import { answerLines } from "./answer_text";
import "./forms.css";

interface AnswerProps {
  readonly message: unknown;
  /** What is shown of a message without fields. */
  readonly empty: string;
}

export function Answer({ message, empty }: AnswerProps) {
  return (
    <pre class="mono answer" tabIndex={0}>
      {answerLines(message).join("\n") || empty}
    </pre>
  );
}
