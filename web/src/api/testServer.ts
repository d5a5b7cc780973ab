/** A server for tests of pages: what it answers to each path, and what it was asked. */

import { vi } from "vitest";

type Answers = Record<string, (message: never) => unknown>;

/** What a server refuses a request with. */
export class Refusal {
  constructor(
    readonly code: string,
    readonly sentence: string,
  ) {}
}

/** Answer the page's requests from now on; gives the list of what is asked: the path and the message of each. */
export function answerBy(answers: Answers): [path: string, message: unknown][] {
  const asked: [string, unknown][] = [];
  const answer = (path: string, request: { body: string }) => {
    const message = JSON.parse(request.body) as unknown;
    asked.push([path, message]);
    const found = answers[path]?.(message as never);
    if (found instanceof Refusal) return Promise.resolve(Response.json({ error: { code: found.code, sentence: { en: found.sentence } } }, { status: 400 }));
    return Promise.resolve(found).then((body) => Response.json(body ?? null));
  };
  vi.stubGlobal("fetch", vi.fn(answer));
  return asked;
}
