import { useCallback, useEffect, useState } from "react";
import { request } from "../api/service";
import type { Requests } from "../generated/messages";
import { attempt } from "./actions";

/**
 * The answer to a request, asked for while a component is shown, and what asks again. `first` until there is one; a
 * refusal is told by a notice. Nothing is asked with a message of null.
 */
export function useAnswer<Name extends keyof Requests, First>(
  name: Name,
  first: First,
  message: Requests[Name]["message"] | null = {},
): [Requests[Name]["answer"] | First, () => Promise<void>] {
  const [answer, setAnswer] = useState<Requests[Name]["answer"] | First>(first);
  const text = JSON.stringify(message);
  const ask = useCallback(async () => {
    const asked = JSON.parse(text) as typeof message;
    if (asked) await attempt(async () => setAnswer(await request(name, asked)));
  }, [name, text]);
  useEffect(() => void ask(), [ask]);
  return [answer, ask];
}
