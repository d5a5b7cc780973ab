/** An image on its way to a car, or back: the server speaks with the car, the page tells how it goes. */

import { socketUrl } from "../api/http";
import type { Outcome, Progress, UploadAnswer } from "../generated/messages";
import { carryBytes, type SerialPort } from "./web-serial";

export type Order = { image: string; verify: boolean } | { readback: true };

export type { Outcome, Progress };

/** The server went away in the middle, or was never there. */
export class CutOffError extends Error {}

/** Follows one socket to the outcome that it tells; `carry` gets what isn't JSON. */
function follow(socket: WebSocket, onProgress: (progress: Progress) => void, carry?: (bytes: ArrayBuffer) => void) {
  return new Promise<Outcome>((resolve, reject) => {
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data !== "string") {
        carry?.(data);
        return;
      }
      const report = JSON.parse(data) as UploadAnswer;
      if ("outcome" in report) resolve(report);
      else onProgress(report);
    });
    socket.addEventListener("close", () => reject(new CutOffError()));
    socket.addEventListener("error", () => reject(new CutOffError()));
  });
}

/** Through one of the server's own ports. */
export async function transfer(port: string, order: Order, onProgress: (progress: Progress) => void): Promise<Outcome> {
  const socket = new WebSocket(socketUrl("/api/upload"));
  socket.addEventListener("open", () => socket.send(JSON.stringify({ port, ...order })));
  try {
    return await follow(socket, onProgress);
  } finally {
    socket.close();
  }
}

/** Through a port of the browser's: the same bytes, which the page only carries. */
export async function transferBySerial(
  port: SerialPort,
  baudRate: number,
  order: Order,
  onProgress: (progress: Progress) => void,
): Promise<Outcome> {
  await port.open({ baudRate });
  const socket = new WebSocket(socketUrl("/api/serial"));
  const carrier = carryBytes(port, (bytes) => socket.readyState === WebSocket.OPEN && socket.send(bytes));
  socket.addEventListener("open", () => socket.send(JSON.stringify(order)));
  try {
    return await follow(socket, onProgress, carrier.write);
  } finally {
    socket.close();
    await carrier.close();
  }
}
