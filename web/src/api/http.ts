/** A service that is a server: requests by HTTP, streams by WebSocket. */

import type { Requests } from "../generated/messages";
import { useStudio } from "../state/studio";
import { openSocket, post } from "./connection";
import { type Service, type Stream, type StreamListeners, type StreamName, UnreachableError } from "./service";

const RETRY_MS = 1500;

/** The server of this page; the store's `service` says whether it answers. */
export class HttpService implements Service {
  private isGone = false;

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
    if (this.isGone) return;
    this.isGone = true;
    useStudio.setState({ service: "gone" });
    const askLater = () => setTimeout(() => void post("/api/capabilities", null).then(back, askLater), RETRY_MS);
    const back = () => {
      this.isGone = false;
      useStudio.setState({ service: "ready" });
    };
    askLater();
  }
}
