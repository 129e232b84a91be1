import { create } from "zustand";

import { Dialog } from "./Dialog";

interface Question {
  text: string;
  /** What one should know of it, line by line. */
  details?: readonly string[];
  /** What the button says that does it. */
  yes: string;
  run(): void;
}
const useQuestion = create<{ question: Question | null }>()(() => ({ question: null }));

/** Asks before something that is not done by the way. */
export function confirm(question: Question): void {
  useQuestion.setState({ question });
}

export function Confirm() {
  const question = useQuestion((state) => state.question);
  if (!question) return null;
  const close = () => useQuestion.setState({ question: null });
  return (
    <Dialog label={question.text} className="confirm" close={close}>
      <p>{question.text}</p>
      {question.details && question.details.length > 0 && (
        <ul className="confirm-details mono scroll" tabIndex={0}>
          {question.details.map((line, i) => (
            <li key={i}>{line}</li>
          ))}
        </ul>
      )}
      <div className="row end">
        <button className="button" onClick={close} autoFocus>
          Cancel
        </button>
        <button
          className="button primary"
          data-testid="confirm"
          onClick={() => {
            close();
            question.run();
          }}
        >
          {question.yes}
        </button>
      </div>
    </Dialog>
  );
}
