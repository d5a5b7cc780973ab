/** A service that is a server: requests by HTTP, streams by WebSocket. */

import type { Requests } from "../generated/messages";
import { useStudio } from "../state/studio";
import { openSocket, post, tryLater } from "./connection";
import { type Service, type Stream, type StreamListeners, type StreamName, UnreachableError } from "./service";

/** The server of this page; the store's `service` says whether it answers. */
export class HttpService implements Service {
  async ask<Name extends keyof Requests>(name: Name, message: Requests[Name]["message"] | null): Promise<Requests[Name]["answer"]> {
    try {
      return (await post(`/api/${name}`, message)) as Requests[Name]["answer"];
    } catch (problem) {
      if (problem instanceof UnreachableError) this.waitUntilBack();
      throw problem;
    }
  }

  openStream(name: StreamName, session: string, listeners: StreamListeners): Stream {
    return openSocket(`/api/${name}?session=${session}`, listeners);
  }

  private waitUntilBack(): void {
    if (useStudio.getState().service === "gone") return;
    useStudio.setState({ service: "gone" });
    const back = () => useStudio.setState({ service: "ready" });
    const askLater = (k: number): unknown => tryLater(k, () => void post("/api/capabilities", null).then(back, () => askLater(k + 1)));
    askLater(0);
  }
}
