/** A question that has to be answered before anything is lost. */

import { create } from "zustand";

export interface Question {
  title: string;
  text: string;
  yes: string;
}

export const useQuestion = create<{ question: Question | null }>(() => ({ question: null }));
let settle: (answer: boolean) => void = () => undefined;

/** Whether the user agreed. A second question while one stands answers the first with no. */
export function confirmed(question: Question): Promise<boolean> {
  settle(false);
  useQuestion.setState({ question });
  return new Promise((resolve) => {
    settle = resolve;
  });
}

export function answer(yes: boolean): void {
  useQuestion.setState({ question: null });
  settle(yes);
}
