/** A service that is a server: requests by HTTP, streams by WebSocket. */

import type { ErrorAnswer, Requests } from "../generated/messages";
import { useStudio } from "../state/studio";
import { RefusedError, type Service, type Stream, type StreamListeners, type StreamName, UnreachableError } from "./service";

const RETRY_MS = 1500;

/** The server of this page; the store's `service` says whether it answers. */
export class HttpService implements Service {
  private isGone = false;

  async ask<Name extends keyof Requests>(name: Name, message: Requests[Name]["message"] | null): Promise<Requests[Name]["answer"]> {
    const body = JSON.stringify(message ?? {});
    const request = { method: "POST", headers: { "Content-Type": "application/json" }, body };
    const response = await fetch(`/api/${name}`, request).catch(() => null);
    // A proxy between page and server answers 502 to 504 where the server itself is gone.
    if (response === null || (response.status >= 502 && response.status <= 504)) {
      this.waitUntilBack();
      throw new UnreachableError();
    }
    if (!response.ok) throw await refused(response);
    return (await response.json()) as Requests[Name]["answer"];
  }

  openStream(name: StreamName, session: string, listeners: StreamListeners): Stream {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/api/${name}?session=${session}`);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", listeners.onOpen);
    socket.addEventListener("message", ({ data }: MessageEvent<string | ArrayBuffer>) => listeners.onMessage(data));
    socket.addEventListener("close", listeners.onClose);
    return {
      send: (data) => {
        if (socket.readyState !== WebSocket.OPEN) return false;
        socket.send(data);
        return true;
      },
      close: () => {
        socket.removeEventListener("close", listeners.onClose);
        socket.close();
      },
    };
  }

  private waitUntilBack(): void {
    if (this.isGone) return;
    this.isGone = true;
    useStudio.setState({ service: "gone" });
    const ask = async () => {
      const response = await fetch("/api/capabilities", { method: "POST", cache: "no-store" }).catch(() => null);
      if (response?.ok) {
        this.isGone = false;
        useStudio.setState({ service: "ready" });
      } else setTimeout(() => void ask(), RETRY_MS);
    };
    setTimeout(() => void ask(), RETRY_MS);
  }
}

async function refused(response: Response): Promise<RefusedError> {
  const body = (await response.json().catch(() => null)) as { error?: ErrorAnswer } | null;
  const plain = `${response.status} ${response.statusText}`;
  return new RefusedError(body?.error?.code ?? plain, body?.error?.sentence ?? { en: plain, zh: plain });
}
