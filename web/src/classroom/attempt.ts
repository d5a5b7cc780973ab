/** How a refused request is told. */

import { useState } from "react";
import { inLanguage, useTexts } from "../i18n";
import { type ClassError, isClassError } from "./ask";

/** A title that may be empty or not known yet, or else another. */
export const titleOr = (title: string | undefined, other: string) => (title === undefined || title === "" ? other : title);

/** Do what may be refused; `problem` is the sentence of the last refusal, until something succeeds. */
export function useAttempt(): { problem: string; attempt: (task: () => Promise<unknown>) => Promise<boolean> } {
  const t = useTexts("class");
  const [error, setError] = useState<ClassError | null>(null);
  const attempt = async (task: () => Promise<unknown>) => {
    try {
      await task();
      setError(null);
      return true;
    } catch (problem) {
      if (!isClassError(problem)) throw problem;
      setError(problem);
      return false;
    }
  };
  if (error === null) return { problem: "", attempt };
  return { problem: "sentence" in error ? inLanguage(error.sentence) : t("noAnswer"), attempt };
}
