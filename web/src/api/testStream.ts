/** A stream whose other end a test plays, and what it sends. */

import type { Stream, StreamListeners } from "./service";

export class PlayedStream implements Stream {
  /** All that were opened, in order. */
  static all: PlayedStream[] = [];
  isOpen = false;
  readonly sent: unknown[] = [];

  constructor(private readonly page: StreamListeners) {
    PlayedStream.all.push(this);
  }

  send(data: unknown): boolean {
    if (this.isOpen) this.sent.push(data);
    return this.isOpen;
  }

  close(): void {
    this.isOpen = false;
  }

  /** What was sent, where all of it is JSON. */
  get messages(): unknown[] {
    return this.sent.map((text) => JSON.parse(text as string) as unknown);
  }

  open(): void {
    this.isOpen = true;
    this.page.onOpen();
  }

  say(data: unknown): void {
    this.page.onMessage(data instanceof ArrayBuffer ? data : JSON.stringify(data));
  }

  /** The other end ends it. */
  end(): void {
    this.isOpen = false;
    this.page.onClose();
  }
}

/** The bytes of a text of hexadecimal digits, which spaces may part. */
export function bytesOf(hex: string): ArrayBuffer {
  const digits = hex.replaceAll(" ", "");
  return Uint8Array.from({ length: digits.length / 2 }, (_, k) => parseInt(digits.slice(2 * k, 2 * k + 2), 16)).buffer;
}
