/** The question that the user answers before something is lost. */

import { create } from "zustand";

export type Choice = "yes" | "other" | "no";

/** `other` is a second way to go on, beside the safe `yes`. */
interface Question {
  title: string;
  text: string;
  yes: string;
  other?: string;
  answer: (chosen: Choice) => void;
}

export const useQuestion = create<{ question: Question | null }>(() => ({ question: null }));

/** Ask the user; true if they agree. */
export async function confirm(question: Omit<Question, "answer" | "other">): Promise<boolean> {
  return (await ask(question)) === "yes";
}

/** Ask the user which way to go on. A second question answers the first one with no. */
export function ask(question: Omit<Question, "answer">): Promise<Choice> {
  useQuestion.getState().question?.answer("no");
  return new Promise((resolve) => {
    const answer = (chosen: Choice) => {
      useQuestion.setState({ question: null });
      resolve(chosen);
    };
    useQuestion.setState({ question: { ...question, answer } });
  });
}
